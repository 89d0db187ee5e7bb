"""The drawing: arrows where they belong, valid SVG, a page that stands alone."""

import json
import math
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st
from short_talk import A, B, C, ms, write

from netsim.errors import NetsimError, ScenarioError
from netsim.replay import style
from netsim.sequence import Asked, write_chart
from netsim.sequence.arrows import ends
from netsim.sequence.ink import SVG, colour, width_of
from netsim.sequence.labels import ABOVE, GAP, SIZE, Room
from netsim.sequence.legend import entries
from netsim.sequence.plan import Plan
from netsim.sequence.scale import TIMES

ALL = f"{{{SVG}}}"


@pytest.fixture(scope="module")
def talk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("talk") / "talk.mcap")


@pytest.fixture(scope="module")
def drawn(talk: Path) -> tuple[Plan, ET.Element]:
    out = talk.with_name("chart.svg")
    layout = write_chart(talk, out, Asked())
    return layout, ET.fromstring(out.read_text(encoding="utf-8"))


def by_class(root: ET.Element, name: str) -> list[ET.Element]:
    return [each for each in root.iter() if name in each.get("class", "").split()]


def arrows(root: ET.Element) -> list[ET.Element]:
    return [each for each in by_class(root, "f") if each.find(f"{ALL}title") is not None]


def test_arrows_lead_from_life_line_to_life_line(drawn: tuple[Plan, ET.Element]) -> None:
    layout, _ = drawn
    assert [layout.x[node] for node in (A, B, C)] == [190.0, 370.0, 550.0]
    for sent in layout.exchange.transmissions:
        for arm in sent.arms:
            (x0, y0), (x1, y1) = ends(layout, sent, arm)
            assert (abs(x0 - layout.x[sent.source]), abs(x1 - layout.x[arm.node])) == (3.5, 3.5)
            assert min(layout.x[sent.source], layout.x[arm.node]) < x0, x1 < max(
                layout.x[sent.source], layout.x[arm.node]
            )
            assert (y0, y1) == (layout.y(sent.start_ns), layout.y(sent.end_ns))
            assert y0 < y1


def test_each_fate_has_its_colour(drawn: tuple[Plan, ET.Element]) -> None:
    _, root = drawn
    ask, tell = (colour(style.kind_colour(place)) for place in (0, 1))
    lost, collided, thin = (colour(each) for each in (style.LOST, style.COLLIDED, style.ACKNOWLEDGEMENT))
    strokes = [
        [path.get("stroke") for path in group.iter(f"{ALL}path") if path.get("stroke")] for group in arrows(root)
    ]
    assert strokes == [[ask], [thin], [tell], [lost, lost], [collided, collided]]
    missed = [
        path.get("stroke")
        for each in by_class(root, "f")
        if each.get("data-f") == "2"
        for path in each.iter(f"{ALL}path")
    ]
    assert missed == [lost]
    dashes = [[path.get("stroke-dasharray") for path in group.iter(f"{ALL}path")] for group in arrows(root)]
    assert dashes[3] == dashes[4] == ["4 3", None]  # the shaft and the cross
    assert dashes[0] == [None, None]  # the shaft and the head


def test_arrows_say_what_they_carry_and_why_they_failed(drawn: tuple[Plan, ET.Element]) -> None:
    _, root = drawn
    words = [text.text for text in by_class(root, "t")]
    for expected in ("#1 ask, 40 byte", "#2 tell, 40 byte → 1 of 2", "#3 ask, 40 byte", "#3 ask, 40 byte, try 2"):
        assert words.count(expected) == 1
    assert {"half duplex", "collided", "leader", "gave up #3: no ack", "verdict"} <= set(words)


def test_pointing_tells_all_about_a_frame(drawn: tuple[Plan, ET.Element]) -> None:
    _, root = drawn
    titles = [group.findtext(f"{ALL}title") for group in arrows(root)]
    assert titles[0] == (
        "ask #1: ann → bob\n"
        "frame of 40 byte, 1.001000 to 1.003000 s, 2 ms on the air\n"
        "received at bob, -60.0 dBm, SINR 20.0 dB\n"
        "the sender's radio drew 100 µJ\n"
        "message: 24 byte, handed over at 1.000000 s\n"
        "on the air 1 ms later\n"
        "delivered to bob after 3 ms, 1 hop"
    )
    assert titles[2].splitlines()[2:4] == ["received: ann", "half duplex: cyd"]
    assert titles[2].endswith("caused by #1")


def test_marks_lie_on_their_life_lines(drawn: tuple[Plan, ET.Element]) -> None:
    layout, root = drawn
    (note,) = by_class(root, "note")
    assert note.findtext(f"{ALL}title") == 'ann notes verdict at 3.002500 s\n{"targets": 2}'
    x, y = map(float, re.match(r"M([\d.]+) ([\d.]+)", note.get("d")).groups())
    assert (x, y) == pytest.approx((layout.x[A], layout.y(ms(3002.5)) - 4.0), abs=0.06)
    (role,) = by_class(root, "role")
    assert float(role.get("x")) == layout.x[B] - 4.6
    assert float(role.get("y")) == pytest.approx(layout.y(ms(1003)), abs=0.06)
    (drop,) = by_class(root, "drop")
    assert drop.findtext(f"{ALL}title") == "cyd gave up ask #3 at 3.003000 s: no ack"


def test_a_link_tells_its_cause_and_its_effect(drawn: tuple[Plan, ET.Element]) -> None:
    layout, root = drawn
    (link,) = [each for each in by_class(root, "c") if each.get("data-m")]
    assert (link.get("data-m"), link.get("data-c")) == ("2", "1")
    numbers = [float(each) for each in re.findall(r"-?[\d.]+", link.get("d"))]
    assert numbers[:2] == pytest.approx([layout.x[B] - 3.0, layout.y(ms(1003))], abs=0.06)
    assert numbers[-2:] == pytest.approx([layout.x[B] - 3.0, layout.y(ms(1005))], abs=0.06)


def test_the_axis_tells_true_times_and_pauses(drawn: tuple[Plan, ET.Element]) -> None:
    _, root = drawn
    axis = next(each for each in root.iter() if each.get("id") == "axis")
    words = [text.text for text in axis.iter(f"{ALL}text")]
    assert {"1.001000", "3.000000", "↕ 1.99 s"} <= set(words)


def test_the_legend_has_what_the_chart_has(drawn: tuple[Plan, ET.Element]) -> None:
    layout, _ = drawn
    assert [entry.label for entry in entries(layout)] == [
        "ask", "tell", "acknowledgement", "not received: half duplex", "collided",
        "a reception led to a sending", "given up", "a note of the algorithm", "holds a role",
        "listen", "receive", "transmit", "overhear", "loses to another signal",
    ]  # fmt: skip


@pytest.mark.parametrize("time", TIMES)
def test_nothing_lies_outside_the_picture(talk: Path, tmp_path: Path, time: str) -> None:
    out = tmp_path / "chart.svg"
    layout = write_chart(talk, out, Asked(time=time))
    root = ET.fromstring(out.read_text(encoding="utf-8"))
    wide, high = layout.width, layout.height
    for rect in by_class(root, "air"):
        x, y, width, height = (float(rect.get(name)) for name in ("x", "y", "width", "height"))
        assert 0 < x < x + width < wide
        assert 0 < y < y + height < high


def test_a_page_stands_alone(talk: Path, tmp_path: Path) -> None:
    out = tmp_path / "chart.html"
    write_chart(talk, out, Asked())
    text = out.read_text(encoding="utf-8")
    assert set(re.findall(r"https?://[^\s\"'<)]+", text)) == {SVG}
    assert not re.findall(r"<(?:link|img|iframe)\b|\bsrc=|@import|\burl\(", text)
    assert "<title>talk &lt;&amp;&gt; more: sequence chart</title>" in text
    ids = Counter(re.findall(r'\bid="([^"]+)"', text))
    assert max(ids.values()) == 1
    wanted = set(re.findall(r'getElementById\("([^"]+)"\)', text)) | {"body", "axis", "names", "corner"}
    assert wanted <= set(ids)
    causes = re.search(r'<script type="application/json" id="cause-data">(.*?)</script>', text)
    assert json.loads(causes[1]) == {"2": [1]}
    switches = re.findall(r'data-hides="([^"]+)"', text)
    assert switches == ["kind-0", "kind-1", "ack", "cause"]


def test_equal_traces_give_equal_charts(talk: Path, tmp_path: Path) -> None:
    texts = []
    for name in ("a.html", "b.html"):
        write_chart(talk, tmp_path / name, Asked())
        texts.append((tmp_path / name).read_bytes())
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("chart.pdf", "expected a name that ends in .svg (a picture) or .html (a page to explore)"),
        ("none/chart.svg", "expected a folder that exists"),
        ("there.svg", "this file exists; give another name, or --force to overwrite it"),
    ],
)
def test_a_bad_place_is_refused(talk: Path, tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "there.svg").write_text("mine")
    with pytest.raises(ScenarioError, match=re.escape(words)):
        write_chart(talk, tmp_path / name, Asked())
    assert (tmp_path / "there.svg").read_text() == "mine"


def test_force_overwrites_and_a_file_that_cannot_be_written_is_told(talk: Path, tmp_path: Path) -> None:
    (tmp_path / "there.svg").write_text("mine")
    write_chart(talk, tmp_path / "there.svg", Asked(), force=True)
    assert (tmp_path / "there.svg").read_text().startswith("<?xml")
    (tmp_path / "folder.svg").mkdir()
    with pytest.raises(NetsimError, match=r"folder.svg: cannot write the chart"):
        write_chart(talk, tmp_path / "folder.svg", Asked(), force=True)


def test_what_fails_half_way_leaves_what_was_there(talk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "there.svg").write_text("mine")

    def half(path: Path, text: str, **_: object) -> None:
        path.write_bytes(text.encode()[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", half)
    with pytest.raises(NetsimError, match="No space left on device"):
        write_chart(talk, tmp_path / "there.svg", Asked(), force=True)
    assert (tmp_path / "there.svg").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["there.svg"]


points = st.tuples(st.floats(0, 500), st.floats(0, 500))
boxes = st.builds(
    lambda left, top, wide, high: (left, top, left + wide, top + high),
    st.floats(-50, 500), st.floats(-50, 500), st.floats(1, 120), st.floats(1, 120),
)  # fmt: skip


def overlap(one: tuple, other: tuple) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


@given(st.lists(boxes, max_size=14))
def test_room_is_given_exactly_where_none_was_taken(wanted) -> None:
    room, taken = Room(), []
    for box in wanted:
        is_free = not any(overlap(box, other) for other in taken)
        assert room.take(box) == is_free
        if is_free:
            taken.append(box)


@given(points, points)
def test_a_label_lies_along_its_arrow_and_above_it(start, end) -> None:
    label = Room().along(start, end, ["#12 belief, 39 byte", "belief"])
    length = math.dist(start, end)
    if label is None:
        assert length < width_of("belief", SIZE) + 2 * GAP + 1e-6
        return
    (x0, y0), (x1, y1) = sorted((start, end), key=lambda point: point[0])
    along = ((label.x - x0) * (x1 - x0) + (label.y - y0) * (y1 - y0)) / length
    above = ((label.x - x0) * (y1 - y0) - (label.y - y0) * (x1 - x0)) / length
    half = width_of(label.text, SIZE) / 2
    assert half + GAP - 1e-6 <= along <= length - half - GAP + 1e-6
    assert above == pytest.approx(ABOVE)
    assert label.text == "belief" or length >= width_of("#12 belief, 39 byte", SIZE)


def test_no_viewer_and_no_plotting_library_is_loaded() -> None:
    code = "import sys, netsim.sequence.page; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"rerun", "matplotlib", "pandas", "pyarrow", "simpy"} & {name.split(".")[0] for name in loaded}
