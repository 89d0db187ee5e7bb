"""Commands stand in the help in the order in which they are used, whatever module they are in."""

from netsim.cli.app import app


def test_the_order_of_the_commands() -> None:
    names = [command.name or command.callback.__name__ for command in app.registered_commands if command.callback]
    assert names == [
        *("run", "study", "check", "replay", "inspect", "flow", "track", "export", "compare", "lifetime", "report"),
        *("calibrate", "list", "schema"),
    ]
