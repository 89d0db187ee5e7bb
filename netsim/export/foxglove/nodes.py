"""The nodes, coloured by the energy they have left, leaders on a white disk; the field and the links under them."""

from collections.abc import Iterable, Mapping

import numpy as np
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from netsim.export.foxglove.shapes import Place, Rgba, disk, entity, lines, loop, sphere, text
from netsim.export.foxglove.stage import Stage
from netsim.replay import style
from netsim.trace.events import (
    Event,
    FieldInfo,
    LinkTable,
    NodeEnergy,
    NodeLife,
    NodePositions,
    NodeTable,
    Role,
)
from netsim.trace.recorder import Handler

TOPIC, LEADERS_TOPIC, FIELD_TOPIC, LINKS_TOPIC = "/scene/nodes", "/scene/leaders", "/scene/field", "/scene/links"
_STEPS = 50
"""Colours between full and empty: nodes are drawn anew only when one changes its colour."""
_LEAST_PRR = 0.1
_DOWN: Mapping[str, Rgba] = {"died": style.DEAD, "failed": style.CRASHED, "crashed": style.CRASHED}

Look = tuple[Place, Rgba]
"""Of a node: where it is, its colour."""


class Nodes:
    """Draws all nodes anew whenever one looks otherwise, so that each message shows them all."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        nodes = stage.nodes
        ids = list(map(int, nodes.node))
        self._full_j = dict(zip(ids, map(float, nodes.battery_j), strict=True))
        self._base: dict[int, Rgba] = dict(zip(ids, map(tuple, style.role_colours(nodes.role).tolist()), strict=True))
        self._share = dict.fromkeys(ids, _STEPS)
        self._colours: list[Rgba] = list(map(tuple, style.energy_colours(np.linspace(0.0, 1.0, _STEPS + 1)).tolist()))
        self._down: dict[int, Rgba] = {}
        self._leads: set[int] = set()
        self._shown: dict[int, Look] = {}

    def handlers(self) -> Mapping[type[Event], Handler]:
        """What changes how a node looks."""
        return {
            NodeTable: self._on_start,
            NodePositions: self._on_positions,
            NodeEnergy: self._on_energy,
            NodeLife: self._on_life,
            Role: self._on_role,
            FieldInfo: self._on_field,
            LinkTable: self._on_links,
        }

    def _on_start(self, event: NodeTable, time_ns: int) -> None:
        self._see(self._share, time_ns)
        if self._leads:
            self._draw_leaders(time_ns)

    def _on_positions(self, event: NodePositions, time_ns: int) -> None:
        self._stage.move(event)
        self._see(map(int, event.node), time_ns)
        if self._leads & set(map(int, event.node)):
            self._draw_leaders(time_ns)

    def _on_energy(self, event: NodeEnergy, time_ns: int) -> None:
        for node, left_j in zip(map(int, event.node), map(float, event.left_j), strict=True):
            full_j = self._full_j.get(node, np.inf)
            if 0.0 < full_j < np.inf:
                self._share[node] = round(_STEPS * min(max(left_j / full_j, 0.0), 1.0))
        self._see(map(int, event.node), time_ns)

    def _on_life(self, event: NodeLife, time_ns: int) -> None:
        if event.event in _DOWN:
            self._down[event.node] = _DOWN[event.event]
        elif event.event in ("started", "rebooted"):
            self._down.pop(event.node, None)
        self._see([event.node], time_ns)

    def _on_role(self, event: Role, time_ns: int) -> None:
        if event.role == "leader":
            (self._leads.add if event.holds else self._leads.discard)(event.node)
            self._draw_leaders(time_ns)

    def _see(self, nodes: Iterable[int], time_ns: int) -> None:
        """Something happened to these nodes: show all if one of them looks otherwise now."""
        looks = {node: self._look(node) for node in nodes if node in self._share}
        if self._stage.is_past or all(self._shown.get(node) == look for node, look in looks.items()):
            return
        self._shown |= looks
        now_ns = self._stage.now_ns(time_ns)
        update = SceneUpdate(entities=(self._entity(node, now_ns) for node in self._share))
        self._stage.show(TOPIC, update, now_ns)

    def _look(self, node: int) -> Look:
        return self._stage.places[node], self._colour(node)

    def _colour(self, node: int) -> Rgba:
        if node in self._down:
            return self._down[node]
        has_battery = 0.0 < self._full_j[node] < np.inf
        return self._colours[self._share[node]] if has_battery else self._base[node]

    def _entity(self, node: int, now_ns: int) -> SceneEntity:
        place, unit_m, name = self._stage.places[node], self._stage.unit_m, self._stage.name(node)
        made = entity(f"node/{node}", now_ns, notes={"node": str(node), "name": name})
        made.spheres.append(sphere(place, 0.0, 2.0 * unit_m, self._colour(node)))
        label = (place[0], place[1] - 1.6 * unit_m)
        made.texts.append(text(label, unit_m, unit_m, style.LABEL, name))
        return made

    def _draw_leaders(self, time_ns: int) -> None:
        """A disk under each leader, all in one entity: whoever leads no more is gone with the next one."""
        now_ns, unit_m = self._stage.now_ns(time_ns), self._stage.unit_m
        made = entity("leaders", now_ns)
        size_m = (3.2 * unit_m, 3.2 * unit_m, 0.1 * unit_m)
        for node in sorted(self._leads & self._stage.places.keys()):
            made.cylinders.append(disk(self._stage.places[node], -unit_m, size_m, style.LEADER))
        self._stage.show(LEADERS_TOPIC, SceneUpdate(entities=[made]), now_ns)

    def _on_field(self, event: FieldInfo, time_ns: int) -> None:
        left_m, low_m = event.x_m, event.y_m
        right_m, top_m = left_m + event.width_m, low_m + event.height_m
        now_ns = self._stage.now_ns(time_ns)
        made = entity("field", now_ns)
        corners = ((left_m, low_m), (right_m, low_m), (right_m, top_m), (left_m, top_m))
        made.lines.append(loop(corners, -2.0 * self._stage.unit_m, 0.1 * self._stage.unit_m, style.FIELD))
        self._stage.show(FIELD_TOPIC, SceneUpdate(entities=[made]), now_ns)

    def _on_links(self, event: LinkTable, time_ns: int) -> None:
        now_ns = self._stage.now_ns(time_ns)
        good = np.asarray(event.prr) >= _LEAST_PRR
        ends = list(
            zip(np.asarray(event.source)[good].tolist(), np.asarray(event.destination)[good].tolist(), strict=True)
        )
        colours = style.prr_colours(np.asarray(event.prr)[good]).tolist()
        made = entity("links", now_ns)
        points = [self._stage.places[node] for pair in ends for node in pair]
        doubled = [each for rgba in colours for each in (rgba, rgba)]
        made.lines.append(lines(points, -1.5 * self._stage.unit_m, 0.08 * self._stage.unit_m, doubled))
        self._stage.show(LINKS_TOPIC, SceneUpdate(entities=[made]), now_ns)
