"""`netsim report`: what it says, and what it says of a folder that is none."""

from in_process import netsim
from typer.testing import CliRunner

from netsim.cli.app import app
from netsim.cli.report import report_command


def test_a_folder_without_a_study_is_one_clear_line(tmp_path):
    done = netsim("report", tmp_path)
    assert done.returncode == 2
    assert "expected the description of a study, got: no such file" in done.stderr
    assert "Traceback" not in done.stderr


def test_it_says_where_the_report_lies(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("netsim.study.report.write_report", lambda folder: folder / "report.html")
    monkeypatch.setattr("netsim.study.tabulate.refresh_tables", lambda folder: None)
    report_command(tmp_path, open_page=False)
    said = capsys.readouterr().out
    assert f"Report: {tmp_path / 'report.html'}" in said
    assert str(tmp_path / "plots") in said


def test_without_a_browser_it_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("netsim.study.report.write_report", lambda folder: folder / "report.html")
    monkeypatch.setattr("netsim.study.tabulate.refresh_tables", lambda folder: None)
    monkeypatch.setattr("webbrowser.open", lambda address: False)
    report_command(tmp_path, open_page=True)
    assert "no browser to open" in capsys.readouterr().err


def test_the_command_is_there():
    assert "report" in CliRunner().invoke(app, ["--help"]).stdout
