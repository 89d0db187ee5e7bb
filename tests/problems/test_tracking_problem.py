"""Tracking problems: who measures what, what sensors read of the truth, and how the truth goes on."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from netsim.errors import ScenarioError
from netsim.kernels.acoustics import BearingModel, wrapped_rad
from netsim.kernels.beamformer import reading_of
from netsim.kernels.grid_belief import condition, uniform
from netsim.models.sound import MicrophoneArray
from netsim.models.track_files import TrackPoint
from netsim.models.tracks import FileTrack, StraightTrack, WaypointTrack
from netsim.problems.tracking import build
from netsim.problems.tracking_parameters import AcousticTarget, AssumedAmplitude, TrackingParameters
from netsim.rng import Streams
from netsim.scenario.build import build as build_scenario
from netsim.scenario.inputs import Gathering
from netsim.scenario.load import load
from netsim.sim.clock import Clock
from netsim.sim.truth import Truth
from netsim.trace.events import TruthTargets
from netsim.trace.recorder import Recorder

S = 10**9
FIELD_M = (0.0, 0.0, 150.0, 250.0)
NORTH = StraightTrack(from_m=(75.0, 0.0), to_m=(75.0, 250.0))
PARAMETERS = TrackingParameters(targets=(AcousticTarget(track=NORTH),))
GRID_M = {row * 4 + column: (37.5 * column + 18.75, 25.0 * row + 12.5) for row in range(10) for column in range(4)}


def source(x_m, y_m, amplitude=40.0, ends_s=1000.0):
    """A source that hardly moves."""
    points = TrackPoint(at_s=0.0, x_m=x_m, y_m=y_m), TrackPoint(at_s=ends_s, x_m=x_m, y_m=y_m + 1e-6)
    return AcousticTarget(track=WaypointTrack(points=points), amplitude=amplitude)


def drawn(parameters=PARAMETERS, positions_m=GRID_M, seed=1, folder=None):
    return build(parameters, positions_m, FIELD_M, Streams(seed), folder)


def one_sensor(parameters, share, seed=1):
    return drawn(replace(parameters, bearing_share=share), {5: (75.0, 100.0)}, seed)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.55, 1.0])
def test_the_share_of_bearing_sensors_is_exact(share):
    measures = [spec.measures_bearing for spec in drawn(replace(PARAMETERS, bearing_share=share)).sensors.values()]
    assert sum(measures) == round(share * 40)


def test_a_greater_share_keeps_the_bearing_sensors_there_were():
    few, more = (
        {
            node
            for node, spec in drawn(replace(PARAMETERS, bearing_share=share)).sensors.items()
            if spec.measures_bearing
        }
        for share in (0.3, 0.6)
    )
    assert few < more


def test_an_amplitude_is_that_of_eq_5_with_its_noise():
    parameters = replace(PARAMETERS, targets=(source(75.0, 130.0),), reading_s=0.5)
    problem = one_sensor(parameters, 0.0)
    readings = np.array([problem.observe(5, time_ns)[0] for time_ns in range(0, 400 * S, S // 2)])
    assert readings.mean() == pytest.approx(40.0 / 30.0, abs=4.0 * 0.05 / math.sqrt(800))
    assert readings.std() == pytest.approx(0.05, rel=4.0 / math.sqrt(2 * 800))


def test_incoherent_sources_add_up_in_power():
    targets = (source(75.0, 110.0, 30.0), source(95.0, 100.0, 80.0))
    problem = one_sensor(replace(PARAMETERS, targets=targets, amplitude_noise_sd=0.0), 0.0)
    assert problem.observe(5, 0)[0] == pytest.approx(5.0)
    assert problem.loudness(5, 0) == pytest.approx(5.0)


def test_nobody_is_louder_than_at_the_least_range():
    quiet = AssumedAmplitude(least_range_m=2.0)
    parameters = replace(PARAMETERS, targets=(source(75.0, 100.0),), amplitude_noise_sd=0.0, amplitude=quiet)
    assert one_sensor(parameters, 0.0).observe(5, 0)[0] == pytest.approx(20.0, rel=1e-6)


def test_a_bearing_is_that_of_the_loudest_source_with_its_error():
    targets = (source(75.0, 50.0, 10.0), source(105.0, 100.0, 40.0))
    problem = one_sensor(replace(PARAMETERS, targets=targets), 1.0)
    readings = np.degrees([problem.observe(5, time_ns)[0] for time_ns in range(0, 400 * S, S // 2)])
    assert readings.mean() == pytest.approx(90.0, abs=4.0 * 3.0 / math.sqrt(800))
    assert readings.std() == pytest.approx(3.0, rel=4.0 / math.sqrt(2 * 800))


def test_without_a_source_there_is_noise_and_any_bearing():
    parameters = replace(PARAMETERS, targets=(source(75.0, 130.0, ends_s=1.0),))
    assert one_sensor(parameters, 0.0).observe(5, 100 * S)[0] == pytest.approx(0.0, abs=0.3)
    problem = one_sensor(parameters, 1.0)
    bearings = np.array([problem.observe(5, time_ns)[0] for time_ns in range(2 * S, 402 * S, S // 2)])
    assert np.abs(np.exp(1j * bearings).mean()) < 4.0 / math.sqrt(800)
    assert (np.abs(bearings) <= math.pi).all()


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("bearings", ["drawn", "sampled"])
def test_a_sensor_read_again_within_an_interval_has_the_same_noise(share, bearings):
    parameters = replace(PARAMETERS, targets=(source(75.0, 130.0),), bearings=bearings)
    problem, again = (one_sensor(parameters, share) for _ in range(2))
    first, later = problem.observe(5, S), problem.observe(5, S + S // 2 - 1)
    np.testing.assert_allclose(first, later, atol=1e-6)
    np.testing.assert_array_equal(first, again.observe(5, S))
    assert np.abs(problem.observe(5, S + S // 2) - first).max() > 1e-6
    assert np.abs(one_sensor(parameters, share, seed=2).observe(5, S) - first).max() > 1e-6


class TestSampled:
    PARAMETERS = replace(PARAMETERS, bearings="sampled", targets=(source(75.0, 150.0),))

    def errors_deg(self, parameters, true_rad, count=40):
        problem = one_sensor(parameters, 1.0)
        processing = problem.knowledge(5).processing
        found = [reading_of(problem.observe(5, step * S // 2), processing) for step in range(count)]
        return np.degrees(wrapped_rad(np.array(found) - true_rad))

    def test_a_node_makes_the_bearing_out_of_samples(self):
        assert one_sensor(self.PARAMETERS, 1.0).observe(5, 0).shape == (4, 512)
        errors = self.errors_deg(self.PARAMETERS, 0.0)
        assert 0.3 < np.std(errors) < 5.0
        assert abs(np.mean(errors)) < 4.0 * np.std(errors) / math.sqrt(len(errors))

    def test_spherical_waves_hardly_bend_the_bearing_from_ten_metres_on(self):
        """Amplitudes and delays follow from the range of each microphone; the beamformer takes the wave for a plane."""
        hann = MicrophoneArray(noise_sd=0.0, window="hann")
        for range_m, most_deg in ((10.0, 0.1), (40.0, 0.02)):
            place = source(75.0 + range_m * math.sin(0.3), 100.0 + range_m * math.cos(0.3))
            errors = self.errors_deg(replace(self.PARAMETERS, targets=(place,), microphones=hann), 0.3, 10)
            assert np.abs(errors).max() < most_deg

    def test_the_louder_source_is_found(self):
        targets = (source(75.0, 130.0, 40.0), source(105.0, 100.0, 4.0))
        assert np.abs(self.errors_deg(replace(self.PARAMETERS, targets=targets), 0.0)).max() < 10.0

    def test_amplitude_sensors_are_not_sampled(self):
        problem = one_sensor(self.PARAMETERS, 0.0)
        assert problem.observe(5, 0).shape == (1,)
        assert problem.knowledge(5).processing is None

    def test_all_sensors_hear_the_same_sound(self):
        """The spectrum of what two sensors hear of one source differs by gain and phase alone."""
        silent = replace(self.PARAMETERS, bearing_share=1.0, microphones=MicrophoneArray(noise_sd=0.0, window="hann"))
        problem = drawn(silent, {1: (75.0, 110.0), 2: (75.0, 190.0)})
        window = np.sin(np.pi * np.arange(512) / 512) ** 2
        one, two = (np.abs(np.fft.rfft(window * problem.observe(node, 0)[0]))[5:40] for node in (1, 2))
        assert np.corrcoef(one, two)[0, 1] > 0.9

    def test_what_a_node_is_told_of_its_microphones(self):
        array = MicrophoneArray(side_m=0.5, samples=100, sampling_hz=8000.0, window="hann")
        processing = one_sensor(replace(self.PARAMETERS, microphones=array), 1.0).knowledge(5).processing
        assert (processing.samples, processing.sampling_hz, processing.window) == (100, 8000.0, "hann")
        assert processing.microphones_m[0] == (0.25, 0.25)


def test_the_loudest_amplitude_sensor_leads_first():
    problem = drawn()
    listening = {
        node: problem.observe(node, 0)[0] for node, spec in problem.sensors.items() if not spec.measures_bearing
    }
    assert problem.first_leader == max(listening, key=listening.__getitem__)
    assert [node for node in GRID_M if problem.knowledge(node).leads_first] == [problem.first_leader]
    assert drawn(replace(PARAMETERS, first_leader="none")).first_leader is None


def test_without_amplitude_sensors_the_loudest_place_leads_first():
    assert drawn(replace(PARAMETERS, bearing_share=1.0)).first_leader in {1, 2}


@pytest.mark.parametrize("odd", [{"cell_m": 7.6}, {"max_speed_m_per_s": 9.9}, {"reading_s": 0.3}])
def test_cells_that_no_belief_could_leave_are_refused(odd):
    with pytest.raises(ValueError, match="or no belief ever moves"):
        replace(PARAMETERS, **odd)
    replace(PARAMETERS, cell_m=7.5)


@pytest.mark.parametrize(("watchdogs", "count"), [("none", 0), ("border", 24), ("all", 40)])
def test_watchdogs(watchdogs, count):
    problem = drawn(replace(PARAMETERS, watchdogs=watchdogs, border_m=20.0))  # the frame of a 10 by 4 grid
    assert len(problem.watchdogs) == count
    assert [node for node in GRID_M if problem.knowledge(node).is_watchdog] == sorted(problem.watchdogs)


def test_a_node_knows_its_neighbours_and_one_more_than_the_least():
    problem = drawn()
    knowledge = problem.knowledge(20)
    near = {node for node in GRID_M if node != 20 and math.dist(GRID_M[node], GRID_M[20]) <= 40.0}
    assert set(knowledge.others) == near
    lonely = drawn(replace(PARAMETERS, neighbourhood_m=1.0)).knowledge(20)
    assert len(lonely.others) == 3
    distances_m = [math.dist(spec.position_m, GRID_M[20]) for spec in lonely.others.values()]
    assert distances_m == sorted(distances_m)


def test_models_are_the_assumed_ones_in_radians():
    spec = next(spec for spec in drawn().sensors.values() if spec.measures_bearing)
    assert spec.model == BearingModel()


def test_the_instance_holds_no_truth():
    content = json.loads(drawn().instance_json())
    assert len(content["sensors"]) == 40
    assert content["grid"] == {"origin_m": [0.0, 0.0], "cell_m": 5.0, "columns": 30, "rows": 50}
    assert "target" not in json.dumps(content).replace("targets", "")


def test_the_truth_is_told_at_every_reading_and_whenever_a_target_comes_or_goes():
    targets = (
        AcousticTarget(track=StraightTrack(from_m=(0.0, 0.0), to_m=(0.0, 7.0), speed_m_per_s=10.0, enters_s=0.3)),
        source(10.0, 20.0),
    )
    problem = drawn(replace(PARAMETERS, targets=targets))
    assert [event.target for event in problem.truth_events()] == [[1]]
    later = dict(problem.later_truth(2 * S))
    assert sorted(later) == [3 * S // 10, S // 2, S, S + 1, 3 * S // 2, 2 * S]
    assert {time_ns: event.target for time_ns, event in later.items() if 0 in event.target} == {
        **{3 * S // 10: [0, 1], S // 2: [0, 1], S: [0, 1]},
    }
    assert later[S // 2].y_m[0] == pytest.approx(2.0)
    assert isinstance(later[S], TruthTargets)


def test_the_truth_is_recorded_at_its_time_before_all_else():
    clock, told, other = Clock(), [], []

    class Observer:
        def handlers(self):
            return {TruthTargets: lambda event, now_ns: told.append((now_ns, event.x_m[0], len(other)))}

    recorder = Recorder(lambda: clock.now_ns, [Observer()])
    for time_ns in (1, 5):
        clock.call_after(time_ns, lambda _: other.append(clock.now_ns))
    Truth(clock, recorder, ((time_ns, TruthTargets([0], [float(time_ns)], [0.0])) for time_ns in (1, 3, 5)))
    clock.environment.run(until=10)
    assert told == [(1, 1.0, 0), (3, 3.0, 1), (5, 5.0, 1)]


def test_who_has_no_sensor_cannot_observe():
    with pytest.raises(ScenarioError, match="node 99 has no sensor"):
        drawn().observe(99, 0)
    with pytest.raises(ScenarioError, match="nobody to track"):
        drawn(positions_m={})


def test_a_track_s_file_that_is_not_there_is_told_with_the_target(tmp_path):
    targets = (AcousticTarget(track=NORTH), AcousticTarget(track=FileTrack(file="no.csv")))
    with pytest.raises(ScenarioError, match=r"targets\[1\].track: .*no.csv: expected a CSV file of a target's ways"):
        drawn(replace(PARAMETERS, targets=targets), folder=tmp_path)


SCENARIO = """
kind: scenario
schema_version: 1
name: tracked
duration_s: 5
field: {width_m: 150, height_m: 250}
nodes:
  - name: sensors
    placement: {type: grid, rows: 5, columns: 4, spacing_m: 30}
problem:
  type: tracking
  bearing_share: 0.5
  targets:
    - track: {type: file, file: ways.csv, target: 7}
    - track: {type: waypoints, points: [{at_s: 0, x_m: 1, y_m: 2}, {at_s: 4, x_m: 30, y_m: 2}]}
    - track: {type: manoeuvre}
algorithm: {type: idsq}
"""


def scenario(folder, more=""):
    (folder / "ways.csv").write_text("target,time_s,x_m,y_m\n7,0,50,50\n7,5,60,60\n8,1,2,3\n", encoding="utf-8")
    (folder / "tracked.yaml").write_text(SCENARIO + more, encoding="utf-8")
    return load(folder / "tracked.yaml")


def test_a_run_s_folder_holds_the_file_of_a_track(tmp_path):
    portable, inputs = Gathering(scenario(tmp_path)).gather()
    assert portable.problem.targets[0].track.file == "inputs/ways.csv"
    assert [each.name for each in inputs] == ["inputs/ways.csv"]


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("bearing: {near_m: 50, far_m: 20}", "near_m at most far_m"),
        ("bearing: {noise_sd_deg: 0.05}", "expected a number >= 0.1"),
        ("microphones: {samples: 2}", "expected a whole number >= 3"),
    ],
)
def test_sensors_that_nobody_could_use_are_refused(tmp_path, setting, words):
    (tmp_path / "tracked.yaml").write_text(
        SCENARIO.replace("  bearing_share: 0.5\n", f"  {setting}\n"), encoding="utf-8"
    )
    with pytest.raises(ScenarioError, match=words):
        load(tmp_path / "tracked.yaml")


WALKER = """\
  - name: walker
    SENSOR
    placement: {type: listed, positions_m: [[10, 10]]}
    mobility: {type: waypoints, points: [{at_s: 4, x_m: 50, y_m: 10}]}
"""


def test_sensors_that_move_are_refused_since_their_readings_would_not(tmp_path):
    (tmp_path / "ways.csv").write_text("target,time_s,x_m,y_m\n7,0,50,50\n7,5,60,60\n", encoding="utf-8")
    path = tmp_path / "tracked.yaml"
    path.write_text(SCENARIO.replace("problem:", WALKER.replace("SENSOR", "sensor: {}") + "problem:"), encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"nodes\[1\].mobility: expected sensors that stay .* group walker"):
        build_scenario(load(path))
    path.write_text(
        SCENARIO.replace("problem:", WALKER.replace("SENSOR", "sensor: null") + "problem:"), encoding="utf-8"
    )
    assert len(build_scenario(load(path)).problem.sensors) == 20


RULES = """
faults:
  - {type: sensor-bias, nodes: [0], bias: 0.25}
  - {type: sensor-noise, nodes: [1], sd: 0.5}
  - {type: sensor-dead, nodes: [2]}
  - {type: sensor-stuck, nodes: [3]}
"""


@pytest.mark.parametrize("sampled", [False, True])
def test_faults_of_sensors_change_readings_as_they_say(tmp_path, sampled):
    settings = "  bearings: sampled\n" if sampled else ""
    text = SCENARIO.replace("  bearing_share: 0.5\n", f"  bearing_share: 1.0\n{settings}")
    (tmp_path / "ways.csv").write_text("time_s,x_m,y_m\n0,50,50\n5,60,60\n", encoding="utf-8")
    (tmp_path / "tracked.yaml").write_text(text.replace(", target: 7", "") + RULES, encoding="utf-8")
    built = build_scenario(load(tmp_path / "tracked.yaml"))
    nodes, problem = built.simulation.nodes, built.problem
    sound = {node: problem.observe(node, 0) for node in range(5)}
    faulty = {node: nodes[node].identity.observe() for node in range(5)}
    processing = problem.knowledge(0).processing
    np.testing.assert_allclose(faulty[0], sound[0] + 0.25)
    assert faulty[1].shape == sound[1].shape
    assert np.abs(faulty[1] - sound[1]).max() > 1e-3
    assert math.isnan(reading_of(faulty[2], processing))
    np.testing.assert_array_equal(faulty[3], sound[3])
    np.testing.assert_array_equal(faulty[4], sound[4])
    if sampled:  # an offset of a microphone is no sound
        assert reading_of(faulty[0], processing) == pytest.approx(reading_of(sound[0], processing), abs=1e-9)


def test_a_dead_sensor_s_reading_leaves_a_belief_as_it_is():
    problem = drawn()
    belief, spec = uniform(problem.grid), problem.sensors[3]
    after, log_evidence = condition(belief, spec.log_likelihood(reading_of(np.zeros(0), None), belief.centres_m))
    np.testing.assert_allclose(after.probability, belief.probability)
    assert log_evidence == pytest.approx(0.0, abs=1e-12)
