"""Compute the figures of ns-3 that docs/validation.md compares with, and store them beside this file.

    python -m venv ns3env && ns3env/bin/pip install ns3
    ns3env/bin/python tools/ns3_reference.py

It needs the `ns3` wheel, not netsim: keep it in an environment of its own. The layout, the frame and the number of
senders are those of `tools/validation/setting.py`, which both sides read.
"""

import importlib.metadata
import json
import pathlib
import sys
import time

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE))

from validation import setting  # noqa: E402


def main() -> None:
    """Run everything and write the file."""
    import cppyy  # comes with the wheel
    from ns import ns

    begun = time.perf_counter()
    if not cppyy.cppdef((HERE / "ns3_reference.cc").read_text(encoding="utf-8")):
        sys.exit("ns3_reference.cc does not compile against the installed ns3")
    model = ns.lrwpan.LrWpanErrorModel()
    figures = {
        "made_with": {"ns3": importlib.metadata.version("ns3"), "python": sys.version.split()[0]},
        "bit_error_rate": {str(snr_db): 1.0 - model.GetChunkSuccessRate(10.0 ** (snr_db / 10.0), 1)
                           for snr_db in setting.GOLDEN_BER},
        "packet_error_rate": {
            f"{snr_db:.2f}": 1.0 - model.GetChunkSuccessRate(10.0 ** (snr_db / 10.0), setting.PER_BITS)
            for snr_db in setting.PER_SNR_DB
        },
        "saturation": {layout: [_saturated(cppyy.gbl.reference, layout, senders, run)
                                for senders in setting.SENDERS for run in range(1, setting.NS3_RUNS + 1)]
                       for layout in setting.LAYOUTS},
    }  # fmt: skip
    out = HERE / "ns3_reference.json"
    out.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    print(f"{out}: {time.perf_counter() - begun:.1f} s")


def _saturated(reference: object, layout: str, senders: int, run: int) -> dict[str, int]:
    x_m, y_m = zip(*setting.positions_m(layout, senders, run), strict=True)
    counts = reference.saturate(  # type: ignore[attr-defined]
        list(x_m), list(y_m), setting.PSDU_BYTE - setting.MAC_OVERHEAD_BYTE, setting.EXPONENT,
        setting.REFERENCE_LOSS_DB, setting.WARM_UP_S, setting.NS3_DURATION_S, run,
    )  # fmt: skip
    if counts.psduByte != setting.PSDU_BYTE:
        sys.exit(f"ns-3 sends frames of {counts.psduByte} bytes, expected {setting.PSDU_BYTE}")
    return {
        "senders": senders,
        "run": run,
        "duration_s": setting.NS3_DURATION_S,
        "acknowledged": int(counts.acknowledged),
        "no_ack": int(counts.noAck),
        "channel_busy": int(counts.channelBusy),
        "other": int(counts.otherwise),
        "frames": int(counts.frames),
    }


if __name__ == "__main__":
    main()
