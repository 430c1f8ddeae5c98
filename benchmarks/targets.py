"""What fingerpad is meant to reach on two cores: one line per number, judged by what a script measured."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """A bound on a measured number.

    Parameters
    ----------
    key : str
        Under which a script reports it.
    benchmark : str
        The script.
    job : str
        What is measured.
    limit : float
        The bound.
    unit : str
        Its unit, "x" for a ratio, empty for a plain number.
    at_least : bool
        Whether the number must reach the bound instead of staying below it.
    """

    key: str
    benchmark: str
    job: str
    limit: float
    unit: str
    at_least: bool = False

    def met_by(self, measured: float) -> bool:
        """Whether a measured number keeps to the bound."""
        return measured >= self.limit if self.at_least else measured <= self.limit

    @property
    def bound(self) -> str:
        """The bound in words.

        Examples
        --------
        >>> Target("ratio", "peers", "against it", 10.0, "x", at_least=True).bound
        '≥ 10 x'
        """
        limit = f"{self.limit:,}" if isinstance(self.limit, int) else f"{self.limit:g}"
        return f"{'≥' if self.at_least else '≤'} {limit} {self.unit}".rstrip()


_PAPER = "paper size, full model, ramp and hold, residual 1e-5"
_SPHERE = "`standard`, half model, one sphere, ramp and hold"
_STANDARD = "`fingerpad reproduce --resolution standard`, everything, cold store"
_QUICK = "`fingerpad reproduce --resolution quick`, everything, cold store"
_GROWTH = "scaling with nodes, 20k to 500k, exponent"
_BLOCK = "layered block of 21,500 nodes"

TARGETS = (
    Target("paper_size_s", "paper_size", f"{_PAPER}: time", 30.0, "s"),
    Target("paper_size_gb", "paper_size", f"{_PAPER}: memory", 4.0, "GB"),
    Target(
        "paper_size_nodes", "paper_size", "paper size, full model: nodes", 232_000, "nodes", at_least=True
    ),
    Target("paper_size_speedup", "paper_size", "paper size, 2 threads against 1", 1.75, "x", at_least=True),
    Target("sphere_s", "sphere", f"{_SPHERE}: time", 2.7, "s"),
    Target("sphere_quick_s", "sphere", "the same at `quick`", 0.6, "s"),
    Target("slide_s", "sphere", "slide of 2 mm with friction 0.5, `quick`", 12.0, "s"),
    Target("force_s", "sphere", "force of 0.5 N, `quick`", 2.0, "s"),
    Target("punch_s", "sphere", "punch of 1 mm with friction 0.5, `quick`", 8.0, "s"),
    Target("sphere_gb", "sphere", f"{_SPHERE}: memory", 1.0, "GB"),
    Target("reproduce_standard_s", "reproduction", f"{_STANDARD}: time", 480.0, "s"),
    Target("reproduce_standard_gb", "reproduction", f"{_STANDARD}: memory", 3.0, "GB"),
    Target("reproduce_quick_s", "reproduction", f"{_QUICK}: time", 90.0, "s"),
    Target("import_s", "startup", "`import fingerpad`, kernels compiled", 0.5, "s"),
    Target("sweep_overhead", "sweeps", "engine and data set of a sweep, over its presses", 0.05, "x"),
    Target("sweep_receptors_s", "sweeps", "10^5 receptors, 100 stored touches", 30.0, "s"),
    Target("sweep_observers", "sweeps", "settings of an observer per minute", 10_000, "", at_least=True),
    Target("touches_memory_growth", "touches", "memory of a sweep, from a tenth to its end", 1.05, "x"),
    Target("growth_time_exponent", "growth", f"{_GROWTH} of time", 1.15, ""),
    # "Linear" is read as an exponent of at most 1.05; the memory of Python itself would reduce the exponent.
    Target("growth_memory_exponent", "growth", f"{_GROWTH} of memory", 1.05, ""),
    Target(
        "mixed_s", "mixed_population", "4,000 mixed afferents, 1 s of touch, solved skin to spikes", 1.0, "s"
    ),
    Target("reduced_step_ms", "reduced", "reduced touch, a step of the skin, 99 %", 1.0, "ms"),
    Target("reduced_spikes_ms", "reduced", "955 afferents, a step of 1 ms, 99 %", 0.3, "ms"),
    Target("reduced_touch_s", "reduced", "reduced touch, 1 s with 955 afferents", 0.5, "s"),
    Target("reduced_built_s", "reduced", "making a reduced touch", 1800.0, "s"),
    Target("reduced_size_mb", "reduced", "file of a reduced touch", 50.0, "MB"),
    Target("reduced_sed_share", "reduced", "touches with SED within 2 % of the peak", 0.95, "", True),
    Target("reduced_force_share", "reduced", "touches with force within 1 % of the peak", 0.95, "", True),
    Target("reduced_coverage", "reduced", "touches within the error bar", 0.95, "", True),
    Target("reduced_static_rate", "reduced", "reduced touch, static rates", 3.0, "spikes/s"),
    Target("reduced_dynamic_rate", "reduced", "reduced touch, dynamic rates", 10.0, "spikes/s"),
    Target("laboratory_ms", "laboratory", "laboratory, from slider to picture, 99 %", 1000.0, "ms"),
    Target("laboratory_static_mb", "laboratory", "static page of the laboratory", 20.0, "MB"),
    Target("laboratory_growth_mb", "laboratory", "laboratory, growth of its server in use", 20.0, "MB"),
    Target(
        "million_triangles_s", "surfaces", "10^6 triangles, read and pressed, more than the sphere", 60.0, "s"
    ),
    Target("afferents_s", "population", "100,000 afferents, 1 s, exact spikes", 1.0, "s"),
    Target("gradient_sum_s", "population", "Gradient Sum, 7 spheres x 100 x 100 x 100", 0.1, "s"),
    Target("session_s", "fitting", "response surfaces, two starts, six folds, given the SED", 30.0, "s"),
    Target("felupe_ratio", "peers", f"{_BLOCK}: times faster than FElupe", 38.0, "x", at_least=True),
    Target("felupe_force_percent", "peers", f"{_BLOCK}: force against FElupe", 1.0, "%"),
    Target("felupe_sed_percent", "peers", f"{_BLOCK}: SED against FElupe", 3.0, "%"),
    Target("calculix_ratio", "peers", f"{_BLOCK}: times faster than CalculiX", 180.0, "x", at_least=True),
    Target("calculix_force_percent", "peers", f"{_BLOCK}: force against CalculiX", 1.0, "%"),
    Target("calculix_sed_percent", "peers", f"{_BLOCK}: SED against CalculiX", 3.0, "%"),
    Target(
        "brian2_ratio", "neurons", "100,000 LIF afferents: times faster than Brian2", 5.0, "x", at_least=True
    ),
    Target("brian2_timing_ratio", "neurons", "spike timing: our error over Brian2's", 1.0, "x"),
)
