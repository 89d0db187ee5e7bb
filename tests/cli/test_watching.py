"""The first Ctrl-C is a wish, the second an order; afterwards signals do what they did before."""

import signal

import pytest

from netsim.cli.watching import progress_bar, wish_to_end


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_first_signal_is_noted_and_the_second_stops(number: int) -> None:
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
    noted: list[str] = []
    with wish_to_end(lambda: noted.append("wish")):
        signal.raise_signal(number)
        assert noted == ["wish"]
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    assert noted == ["wish"]
    assert {each: signal.getsignal(each) for each in before} == before


def test_without_a_terminal_there_is_no_bar() -> None:
    with progress_bar() as bar:
        assert bar is None
