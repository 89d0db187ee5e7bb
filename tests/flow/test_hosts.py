"""What befalls the hosts of a model: who is down when, and who takes over what."""

import json

from netsim.flow.hosts import HostLog
from netsim.trace.events import AlgorithmRecord, NodeLife

HOSTS = {10: 0, 11: 1, 12: 1}


def test_a_vertex_is_down_with_its_host_until_another_node_takes_it_over() -> None:
    log = HostLog()
    log.add_life(NodeLife(1, "started", "MessagePassing"), 0)
    log.add_life(NodeLife(1, "crashed", "fault rule"), 50)
    log.add_record(AlgorithmRecord(0, "rehosted", json.dumps({"variable": 12, "epoch": 1, "round": 6, "other": 1})), 80)
    log.add_record(AlgorithmRecord(0, "notices", "{}"), 80)
    log.add_life(NodeLife(1, "rebooted", "MessagePassing"), 100)
    assert [sorted(log.down_at(HOSTS, time_ns)) for time_ns in (49, 50, 79, 80, 99, 100)] == [
        [],
        [11, 12],
        [11, 12],
        [11],
        [11],
        [],
    ]
    assert [(each.vertex, each.host, each.before) for each in log.taken_over_for(7)] == [(12, 0, 1)]
    assert log.taken_over_for(6) == ()


def test_a_node_that_never_went_down_is_not_noted() -> None:
    log = HostLog()
    log.add_life(NodeLife(1, "started", "MessagePassing"), 0)
    log.add_life(NodeLife(1, "finished", ""), 9)
    assert not log.changes
