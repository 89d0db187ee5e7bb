"""What a device table says of its own sources, in one line."""

from pathlib import Path
from typing import Any, Final

from netsim.models.device_tables import Kind, find_table, table_values, unverified
from netsim.models.devices import MAINS

_MAIN_VALUES: Final[dict[Kind, tuple[tuple[str, ...], ...]]] = {
    "radios": (("receive_ma",),),
    "cpus": (("active_ma",),),
    "batteries": (("energy_j",), ("chemistry", "capacity_mah"), ("chemistry", "alpha_ma_min")),
}
"""The value that says most about a device, and so the document behind it; the first that a table has."""


def table_source(kind: Kind, name_or_path: str, base_dir: Path) -> tuple[str, str]:
    """The device's own name, and where its main value was read.

    That is a radio's receive current, a processor's active current, a battery's energy or charge. The source ends with how
    many of the table's values are recalled or chosen, where any are.

    Args:
        kind: Which table.
        name_or_path: A shipped name, or a path.
        base_dir: What a relative path is relative to.

    Raises:
        ScenarioError: If there is no such table, or it cannot be read.
    """
    if kind == "batteries" and name_or_path == MAINS.name:
        return "mains power", "netsim's own"
    path = find_table(kind, name_or_path, base_dir)
    plain = table_values(path)
    keys = next(keys for keys in _MAIN_VALUES[kind] if _below(plain, keys) is not None)
    recalled, total = unverified(path)
    share = "all" if len(recalled) == total else f"{len(recalled)} of {total}"
    remark = f" ({share} values recalled or chosen)" if recalled else ""
    return plain["name"], f"{keys[-1]}: {_below(plain, keys)['source']}{remark}"


def _below(plain: Any, keys: tuple[str, ...]) -> Any:
    for key in keys:
        plain = plain.get(key) if isinstance(plain, dict) else None
    return plain
