"""Numbers and lists as text."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

ABSENT = "–"
UNBROKEN = "\N{NO-BREAK SPACE}"
PHASE_LABELS = {"dynamic": "dynamic ramp", "static": "static hold"}
PARAMETER_SYMBOLS = {
    "intercept_ma": "intercept β",
    "dynamic_gain": "dynamic gain k_d",
    "static_gain": "static gain k_s",
    "time_constant_ms": "time constant τ",
    "capacitance_mf": "capacitance C",
    "threshold_mv": "threshold v",
}
"""The six parameters of the paper, with their symbols."""

IDENTIFIABLE_SYMBOLS = {
    "intercept_per_ms": "β/(C v)",
    "dynamic_gain_per_kpa": "k_d/(C v)",
    "static_gain_per_kpa_ms": "k_s/(C v)",
    "time_constant_ms": "τ",
}
"""The four identifiable numbers."""

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with so many significant digits, or a dash for one that does not exist."""
    if value is None or math.isnan(value):
        return ABSENT
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if float(value).is_integer() or abs(value) < 10.0**digits:
        shown = float(value) if float(value).is_integer() else float(f"{value:.{digits}g}")
    else:
        shown = float(round(value))
    size = abs(shown)
    if size >= 1e6 or 0.0 < size < 1e-3:
        mantissa, exponent = f"{size:.{digits - 1}e}".split("e")
        mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        text = f"{mantissa} × 10{str(int(exponent)).translate(_SUPERSCRIPT)}"
    elif size >= 1e4:
        text = f"{size:,.0f}".replace(",", " ")
    else:
        text = f"{size:.12g}"
    return f"−{text}" if shown < 0.0 else text


def fixed(value: float | None, decimals: int) -> str:
    """Return a number with so many decimals, for columns of numbers."""
    if value is None or not math.isfinite(value):
        return number(value)
    return f"{value:.{decimals}f}".replace("-", "−")


def joined(parts: Sequence[str]) -> str:
    """Return a list as a sentence has it."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def spelled(key: str) -> str:
    """Return the name of a field in words, its unit in brackets."""
    words = key.split("_")
    for length, unit in ((2, _UNITS.get("_".join(words[-2:]))), (1, _UNITS.get(words[-1]))):
        if unit and len(words) > length:
            return f"{' '.join(words[:-length])} [{unit}]"
    return " ".join(words)


_UNITS = {
    "per_m": "1/m", "per_mm": "1/mm", "mm": "mm", "mm2": "mm²", "mm3": "mm³", "ms": "ms", "s": "s",
    "mb": "MB", "hz": "spikes/s", "kpa": "kPa", "mn": "mN", "ma": "mA", "mf": "mF", "mv": "mV",
}  # fmt: skip


def plain(value: Any, digits: int = 3, longest: int = 8) -> str:
    """Return any JSON value as a short text: lists above the longest by their size and range."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or isinstance(value, int | float):
        return number(value, digits)
    if isinstance(value, Mapping):
        return "; ".join(
            f"{spelled(str(key))}: {plain(item, digits, longest)}" for key, item in value.items()
        )
    if isinstance(value, Sequence) and not isinstance(value, str):
        if len(value) <= longest:
            items = [plain(item, digits, longest).removesuffix(".") for item in value]
            return ("; " if any(", " in item for item in items) else ", ").join(items) or ABSENT
        known = [item for item in value if isinstance(item, int | float) and not math.isnan(item)]
        span = f", {number(min(known))} … {number(max(known))}" if known else ""
        return f"{len(value)} values{span}"
    return str(value)


def whole_percent(share: float | None) -> str:
    """Return a share in whole percent, or a dash for one that does not exist."""
    return f"{fixed(None if share is None else 100.0 * share, 0)} %"


def with_error(value: float | None, error: float | None, decimals: int = 2) -> str:
    """Return a number with its error, which no line break separates."""
    return f"{fixed(value, decimals)}{UNBROKEN}±{UNBROKEN}{fixed(error, decimals)}"
