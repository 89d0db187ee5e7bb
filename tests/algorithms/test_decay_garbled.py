"""Correlation decay where wrong bytes pass for right ones: nobody is stopped, and what cannot be is not believed."""

from dataclasses import replace

import numpy as np
import pytest
from decay_rig import PROBLEM, problem, shipped
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.algorithms.decay_payload import narrowed, rounding_m
from netsim.kernels.event_association import PredictedEvent

seeds = st.integers(0, 2**32 - 1)
LONGER = "duration_s=95", "algorithm.until_s=90"


@pytest.mark.parametrize("factors", ["local", "requests"])
def test_frames_with_wrong_bytes_stop_nobody(scenarios, factors):
    """A third of all frames garbled, and no checksum tells."""
    garbled = "faults=[{type: corruption, share: 0.3, undetected_share: 1.0}]"
    for seed in (1, 2):
        chosen = [f"seed={seed}", "algorithm.estimator=literal", f"algorithm.factors={factors}", *LONGER]
        assert shipped(scenarios, garbled, *chosen)["gated_pairs_told_share"] == 1.0


@settings(deadline=None, max_examples=8)
@given(seeds, st.sampled_from(["float64", "float32", "float16"]), st.sampled_from([0.0, 700.0]))
def test_what_sensors_report_is_possible_and_what_another_would_is_not(seed, width, away_m):
    scene = problem(seed, away_m=away_m)
    reach_m = PROBLEM.sensing_radius_m + PROBLEM.model.reach_m
    for node, place_m in scene.sensors_m.items():
        knowledge, points_m = scene.knowledge(node), narrowed(scene.observe(node, 0), width)
        margin_m = rounding_m(place_m, width, reach_m)
        events = [
            replace(event, x_m=x_m, y_m=y_m)
            for event in knowledge.events
            for x_m, y_m in narrowed(np.array([(event.x_m, event.y_m)]), width).tolist()
        ]
        assert knowledge.is_possible(node, points_m, events, margin_m)
        far = place_m + np.array([[PROBLEM.sensing_radius_m + 2.0 * margin_m, 0.0]])
        assert not knowledge.is_possible(node, far, (), margin_m)
        assert not knowledge.is_possible(node, np.full((1, 2), np.nan), (), margin_m)
        assert not knowledge.is_possible(node, np.full((1, 2), np.inf), (), margin_m)
        assert not knowledge.is_possible(99, points_m, events, margin_m)
        strange = PredictedEvent(0, 99, *place_m)
        assert not knowledge.is_possible(node, points_m, [strange], margin_m)
        away = PredictedEvent(0, node, place_m[0] + reach_m + 2.0 * margin_m, place_m[1])
        assert not knowledge.is_possible(node, points_m, [away], margin_m)
