"""From the groups that move to the nodes' ways."""

from collections.abc import Sequence

from netsim.errors import Finding, ScenarioError
from netsim.models.waypoints import Waypoint, WaypointMobility, path_through, read_waypoints
from netsim.scenario.load import LoadedScenario
from netsim.scenario.places import Place
from netsim.sim.mobility import Mover, MovingAir
from netsim.units import s_to_ns


def movers(loaded: LoadedScenario, nodes: Sequence[Place]) -> dict[int, Mover]:
    """The nodes that move, by id.

    Raises:
        ScenarioError: For files that cannot be read, nodes that a file names and the group has not, and points for a group
            of several nodes.
    """
    findings: list[Finding] = []
    found: dict[int, Mover] = {}
    for index, group in enumerate(loaded.scenario.nodes):
        if group.mobility is None:
            continue
        members = {place.id: place for place in nodes if place.group_index == index}
        ways = _ways(loaded, index, group.mobility, members, findings)
        for number, points in ways.items():
            place = members[number]
            path = path_through((place.x_m, place.y_m), points)
            found[number] = Mover(path, s_to_ns(group.mobility.update_s))
    if findings:
        raise ScenarioError(findings)
    return found


def require_moving_air(loaded: LoadedScenario, air: MovingAir) -> None:
    """Refuse nodes that move where links cannot.

    Raises:
        ScenarioError: With a finding at the first group that moves.
    """
    try:
        air.relocate({})
    except ScenarioError as error:
        index = next(index for index, group in enumerate(loaded.scenario.nodes) if group.mobility is not None)
        raise ScenarioError([loaded.document.finding(("nodes", index, "mobility"), str(error), "")]) from error


def require_still_sensors(loaded: LoadedScenario) -> None:
    """Refuse sensors that move, for a problem whose readings are those at the places where sensors stand at the start.

    Raises:
        ScenarioError: With a finding at every group of nodes with sensors that moves.
    """
    findings = [
        loaded.document.finding(
            ("nodes", index, "mobility"),
            f"sensors that stay where they are, in a problem of type {loaded.scenario.problem.type}",
            f"nodes with sensors that move: group {group.name}",
            "let nodes move that have `sensor: null`",
        )
        for index, group in enumerate(loaded.scenario.nodes)
        if group.mobility is not None and group.role == "sensor" and group.sensor is not None
    ]
    if findings:
        raise ScenarioError(findings)


def _ways(
    loaded: LoadedScenario,
    index: int,
    mobility: WaypointMobility,
    members: dict[int, Place],
    findings: list[Finding],
) -> dict[int, tuple[Waypoint, ...]]:
    path = ("nodes", index, "mobility")
    if mobility.file is None:
        if len(members) == 1:
            return dict.fromkeys(members, mobility.points)
        remedy = "give each its own group, or all of them a `file`"
        findings.append(loaded.document.finding((*path, "points"), "a group of one node", f"{len(members)}", remedy))
        return {}
    try:
        ways = read_waypoints(loaded.folder / mobility.file)
    except ScenarioError as error:
        whole = loaded.document.finding((*path, "file"), str(error), "")
        findings += error.findings or (whole,)
        return {}
    if strangers := sorted(set(ways) - set(members)):
        ids = ", ".join(map(str, strangers))
        findings.append(loaded.document.finding((*path, "file"), "nodes of this group", f"also the nodes {ids}"))
        return {}
    return ways
