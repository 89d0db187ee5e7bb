"""From a testbed's log to the medium of a scenario: `netsim calibrate`.

    log = read_log(Path("testbed.csv"))
    found = calibrate(log, Options(positions=read_nodes(Path("nodes.csv"))))
    print(medium_yaml(found))

Nothing here knows the command line.
"""

from netsim.calibrate.fit import calibrate
from netsim.calibrate.found import Calibration, Options
from netsim.calibrate.log import TestbedLog, read_log
from netsim.calibrate.report import medium_yaml, tables

__all__ = ["Calibration", "Options", "TestbedLog", "calibrate", "medium_yaml", "read_log", "tables"]
