"""Recordings that users bring, from CSV and NWB files: rates or spikes, stimulus by stimulus."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import check_file
from fingerpad.core.logger import LOGGER
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.tables import TableRow, column_of, read_csv
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import FloatArray, Whole, not_negative, numbers_in, positive
from fingerpad.experiments.requests.stimuli import NamedStimulus, Stimuli
from fingerpad.inference.recordings import PHASES, RateRecordings, SpikeRecordings

RATES = tuple(f"{phase}_rate_hz" for phase in PHASES)
SPIKES = "spike_times_ms"
DURATION = "duration_ms"
FOLD = "fold"
LARGEST_NWB_MB = 20_000
_SAME_S = 1e-6  # Times that differ by less are the same: they are sums of rounded ones. [s]

SUFFIXES_OF_NWB = (".nwb", ".h5", ".hdf5")


@dataclass(frozen=True)
class Recorded:
    """Recordings with the stimuli they belong to."""

    recordings: RateRecordings | SpikeRecordings  #: What the afferent answered.
    stimuli: Mapping[str, NamedStimulus]  #: What touched it, in the order of their first presentations.
    memberships: NDArray[np.int64] | None  #: Fold of each stimulus, from 0, if the file says, (n_stimuli,).
    presentations: Mapping[str, int]  #: How often each was presented.
    spikes_after_hold: int = 0
    """Spikes that came after the motion had ended and are not used, since the model ends there."""


def recorded_of(recordings: RateRecordings | SpikeRecordings | Recorded, stimuli: Stimuli) -> Recorded:
    """Return recordings of Python with the stimuli that their names mean."""
    if isinstance(recordings, Recorded):
        return recordings
    known = {name: stimuli.named(name) for name in dict.fromkeys(recordings.stimuli)}
    return Recorded(recordings, known, None, dict(Counter(recordings.stimuli)))


@checked
def read_recordings(path: str | Path, stimuli: Stimuli, unit: Whole | None = None) -> Recorded:
    r"""Read what an afferent answered to known stimuli.

    Parameters
    ----------
    path : str or Path
        A CSV file with one row per presentation: the column of `stimuli`, then `dynamic_rate_hz`,
        `static_rate_hz` or both, or `spike_times_ms` (times from the onset, separated by spaces); optionally
        `duration_ms` (of the recording of spikes, by default until the end of the motion) and `fold`
        (from 1). Or an NWB file (.nwb, .h5, .hdf5), whose table of trials has the column of `stimuli` and
        optionally `fold`, and whose trials start with the onset of the indentation.
    stimuli : Stimuli
        `ShiftedBar()` or `read_stimuli(...)`.
    unit : int, optional
        Id of the spike unit of an NWB file; not needed if it has one.

    Returns
    -------
    Recorded
        Rates are means over the presentations of a stimulus; spikes stay as they are.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from fingerpad.experiments.requests.stimuli import ShiftedBar
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "rates.csv"
    ...     _ = path.write_text("shift_mm,static_rate_hz\n-1.5,60\n0,10\n-1.5,62\n", encoding="utf-8")
    ...     recorded = read_recordings(path, ShiftedBar())
    >>> recorded.recordings.stimuli, recorded.recordings.static_rate_hz.tolist()
    (('-1.5', '0'), [61.0, 10.0])
    """
    path = Path(path)
    if path.suffix in SUFFIXES_OF_NWB:
        with nwb_session(path) as session:
            lines = _trials(path, session, stimuli.column, unit)
    elif unit is None:
        lines = read_csv(path, (stimuli.column, *RATES, SPIKES, DURATION, FOLD))
    else:
        raise InputError(f"unit belongs to NWB files ({', '.join(SUFFIXES_OF_NWB)}): {path} is none.")
    _check_columns(path, stimuli.column, lines[0])
    known: dict[str, NamedStimulus] = {}
    for line in lines:
        entry = line.text(stimuli.column)
        if entry not in known:
            with line.placed():
                known[entry] = stimuli.named(entry)
    presented = [known[line.text(stimuli.column)] for line in lines]
    names = [stimulus.name for stimulus in presented]
    memberships = _memberships(path, lines, names) if FOLD in lines[0].entries else None
    recordings: RateRecordings | SpikeRecordings
    if SPIKES in lines[0].entries:
        recordings, after = _spikes(lines, presented, str(path))
    else:
        recordings, after = _mean_rates(lines, names, str(path)), 0
    found = {stimulus.name: stimulus for stimulus in presented}
    return Recorded(recordings, found, memberships, dict(Counter(names)), after)


def _check_columns(path: Path, column: str, first: TableRow) -> None:
    given = first.entries
    if column not in given:
        raise InputError(path, f"must have the column {column}", remedy=f"it has {', '.join(given)}")
    rates = [name for name in RATES if name in given]
    if SPIKES in given and rates:
        raise InputError(
            path, f"must have {SPIKES} or rates, not both", remedy=f"leave {' and '.join(rates)} out"
        )
    if SPIKES not in given and not rates:
        raise InputError(
            path, f"must have {', '.join(RATES)} or {SPIKES}", remedy=f"it has {', '.join(given)}"
        )
    if DURATION in given and SPIKES not in given:
        raise InputError(f"{path} has {DURATION}, which belongs to {SPIKES}: leave it out.")


def _mean_rates(lines: Sequence[TableRow], names: Sequence[str], source: str) -> RateRecordings:
    presented: dict[str, list[int]] = {}
    for number, name in enumerate(names):
        presented.setdefault(name, []).append(number)
    means: dict[str, FloatArray | None] = dict.fromkeys(RATES)
    for column in RATES:
        if column in lines[0].entries:
            rates = column_of(lines, column, "spikes/s", not_negative)
            means[column] = np.array([rates[numbers].mean() for numbers in presented.values()])
    return RateRecordings(tuple(presented), **means, source=source)


def _spikes(
    lines: Sequence[TableRow], presented: Sequence[NamedStimulus], source: str
) -> tuple[SpikeRecordings, int]:
    """Trains until the motion or the recording ends, and the number of spikes after the motion."""
    trains, durations, after = [], [], 0
    for line, stimulus in zip(lines, presented, strict=True):
        end = stimulus.motion.end_ms
        recorded = line.number(DURATION, "ms", positive) if line.has(DURATION) else np.inf
        times = spike_times(line)
        if times.size and times[-1] > recorded:
            raise InputError(
                f"{line.place}: {SPIKES} must end with {DURATION}, {recorded:g} ms: got {times[-1]:g} ms."
            )
        trains.append(times[times <= end])
        durations.append(min(end, recorded))
        after += int((times > end).sum())
    last = max((float(train[-1]) for train in trains if train.size), default=np.inf)
    if last <= min(durations) / MS_PER_S and sum(map(len, trains)) > len(trains):
        raise InputError(
            f"{SPIKES} of {source} must be in ms: the last of all spikes came {last:g} ms after the start of "
            f"a touch of {min(durations):g} ms, as if they were in s; multiply them by 1000."
        )
    recordings = SpikeRecordings(
        tuple(stimulus.name for stimulus in presented),
        SpikeTrains.from_lists(trains),
        np.array(durations),
        source,
    )
    return recordings, after


def spike_times(line: TableRow) -> FloatArray:
    """Spike times of a presentation, none if the entry is empty; checked for their order."""
    entry = line.entries[SPIKES]
    with line.placed():
        if isinstance(entry, str):
            entry = numbers_in(SPIKES, entry.split(), "ms")
            not_negative(SPIKES, entry.min(initial=0.0), "ms")
        times = np.asarray(entry, dtype=np.float64)
        backwards = times[1:] <= times[:-1]
        if backwards.any():
            before, behind = times[backwards.argmax() :][:2]
            raise InputError(f"{SPIKES} must increase: {behind:g} ms follows {before:g} ms, sort them.")
    return times


def _memberships(path: Path, lines: Sequence[TableRow], names: Sequence[str]) -> NDArray[np.int64]:
    """Fold of each stimulus from 0; every fold is a set of stimuli, so that none is fitted and judged."""
    first: dict[str, tuple[int, TableRow]] = {}
    for line, name in zip(lines, names, strict=True):
        fold = line.number(FOLD)
        if fold != int(fold) or fold < 1:
            raise InputError(f"{line.place}: {FOLD} must be a whole number from 1: got {line.text(FOLD)!r}.")
        before, where = first.setdefault(name, (int(fold), line))
        if before != fold:
            raise InputError(
                f"{line.place}: {FOLD} must be the same for all presentations of {name}, which would be "
                f"fitted and judged at once: got {fold:g}, and {before} in {where.place}."
            )
    folds = [fold for fold, _ in first.values()]
    used = set(folds)
    # The first fold without a stimulus is at most the number of stimuli + 1, however large a fold is.
    missing = next(fold for fold in range(1, len(used) + 2) if fold not in used)
    if missing <= max(2, *used):
        raise InputError(
            f"{path}: {FOLD} must number at least two folds from 1 without a gap: "
            f"no row is in fold {missing}."
        )
    return np.array(folds, dtype=np.int64) - 1


@contextmanager
def nwb_session(path: Path) -> Iterator[Any]:
    """Content of an NWB file while it is open; whatever fails on it is one `InputError`."""
    check_file(path, LARGEST_NWB_MB)
    try:
        from pynwb import NWBHDF5IO
    except ImportError as error:
        raise InputError(
            path, "needs pynwb", remedy="install the extra, pip install 'fingerpad[nwb]'"
        ) from error
    try:
        # What the libraries warn of (cached namespaces, types of old files) is not about what is read here.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with NWBHDF5IO(str(path), mode="r") as file:
                yield file.read()
    except InputError:
        raise
    except Exception as error:  # a file of any other kind may fail in any way
        said = " ".join(str(error).split()).rstrip(".")
        raise InputError(f"{path} cannot be read as NWB ({said}): check it with nwbinspector.") from error


def _trials(path: Path, content: Any, column: str, unit: int | None) -> list[TableRow]:
    """Trials of an NWB file as lines of a table, with the spikes of one unit."""
    trials = content.trials
    if trials is None or not len(trials):
        raise InputError(
            path, f"must have a table of trials with start_time and {column}", remedy="it has none"
        )
    if column not in trials.colnames:
        raise InputError(f"{path}: trials must have the column {column}: got {', '.join(trials.colnames)}.")
    row = _row_of_unit(path, content.units, unit)
    spikes_s, observed_s = _spikes_of_unit(path, content.units, row), _observed(content.units, row)
    starts, stops = (np.asarray(trials[name][:], dtype=np.float64) for name in ("start_time", "stop_time"))
    _check_clock(path, spikes_s, starts, stops, observed_s is not None)
    invalid = content.invalid_times
    lines = []
    for trial, (start, stop) in enumerate(zip(starts, stops, strict=True)):
        end = stop
        if observed_s is not None:
            during = (observed_s[:, 0] <= start + _SAME_S) & (observed_s[:, 1] > start + _SAME_S)
            if not during.any():
                continue
            end = min(stop, observed_s[during, 1].max())
        if (
            invalid is not None
            and ((invalid["start_time"][:] < end) & (invalid["stop_time"][:] > start)).any()
        ):
            continue
        within = spikes_s[(spikes_s >= start) & (spikes_s <= end)]
        entries = {
            column: trials[column][trial],
            SPIKES: (within - start) * MS_PER_S,
            DURATION: (end - start) * MS_PER_S,
        }
        if FOLD in trials.colnames:
            entries[FOLD] = trials[FOLD][trial]
        lines.append(TableRow(f"{path}, trial {trials.id[trial]}", entries))
    if not lines:
        raise InputError(
            f"{path}: a trial must start while the unit is observed: none does, see obs_intervals and "
            "invalid_times."
        )
    if len(lines) < len(starts):
        LOGGER.warning(
            "%s: %d of %d trials are left out, since the unit was not observed then.",
            path, len(starts) - len(lines), len(starts),
        )  # fmt: skip
    return lines


def _check_clock(
    path: Path, spikes_s: FloatArray, starts_s: FloatArray, stops_s: FloatArray, observed: bool
) -> None:
    """Raise an error if spikes seem to count from the onset of their trials, not from that of the session."""
    # They all come within one duration of a trial, and no trial has any, or the first alone, which starts
    # then.
    if observed or not spikes_s.size or len(starts_s) < 2:
        return
    answered = [
        ((spikes_s >= start) & (spikes_s <= stop)).any()
        for start, stop in zip(starts_s, stops_s, strict=True)
    ]
    if sum(answered) <= 1 and spikes_s[-1] <= np.max(stops_s - starts_s):
        raise InputError(
            f"{path}: spike_times must count from the start of the session, as start_time does: all "
            f"{spikes_s.size} lie within {spikes_s[-1]:g} s, as if they counted from that of their trial; "
            "add start_time to them, or give the unit obs_intervals if it fired then alone."
        )


def _row_of_unit(path: Path, units: Any, unit: int | None) -> int:
    """Row of the unit that was chosen, or of the only one."""
    ids = [] if units is None else [int(number) for number in units.id[:]]
    if not ids or "spike_times" not in units.colnames:
        raise InputError(path, "must have a table of units with spike_times", remedy="it has none")
    if unit is None and len(ids) > 1:
        raise InputError(f"{path} has the units {', '.join(map(str, ids))}: choose one by --unit.")
    chosen = ids[0] if unit is None else unit
    if chosen not in ids:
        raise InputError(f"{path}: unit must be one of {', '.join(map(str, ids))}: got {chosen}.")
    return ids.index(chosen)


def _spikes_of_unit(path: Path, units: Any, row: int) -> FloatArray:
    """Spike times of a unit. [s]"""
    times = np.asarray(units["spike_times"][row], dtype=np.float64)
    if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
        raise InputError(
            f"{path}: spike_times of unit {units.id[row]} must be finite and increase from the start of the "
            "session: sort them, or add start_time if they begin anew in each trial."
        )
    return times


def _observed(units: Any, row: int) -> FloatArray | None:
    """Intervals (n, 2) in which a unit was observed, joined where they touch; None if none are given. [s]"""
    given = units["obs_intervals"][row] if "obs_intervals" in units.colnames else ()
    intervals = np.asarray(given, dtype=np.float64).reshape(-1, 2)
    if not len(intervals):
        return None
    begin, end = intervals[np.argsort(intervals[:, 0])].T
    end = np.maximum.accumulate(end)
    apart = begin[1:] > end[:-1] + _SAME_S
    return np.column_stack([begin[np.r_[True, apart]], end[np.r_[apart, True]]])
