"""Computing that is not put off and not left out: what the node's energy allowance refuses is said so in the trace.

For work whose result others wait for, and that is small beside what brought it about; where a node can wait for its
allowance or do without, see `netsim.algorithms.patient_compute`.
"""

from netsim.api import NodeHandle, NoEnergyError, Op


def charge(node: NodeHandle, operations: int) -> Op[None]:
    """Occupy the CPU; what the node's energy allowance refuses is computed all the same, and said so."""
    try:
        yield from node.compute(operations)
    except NoEnergyError:
        node.log("too little energy to compute: it is charged to nobody")
