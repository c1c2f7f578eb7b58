"""The verdict on a reconstruction: one sentence, and what to do next."""

from __future__ import annotations

from dataclasses import dataclass

from nacre.evaluation import AbsoluteTrajectoryError
from nacre.evaluation.trajectory import MIN_ALIGNED
from nacre.report.data import ReportData
from nacre.report.deformation import deformation_figures
from nacre.report.findings import Finding, Level, find_problems
from nacre.run_data.text import count, quantity


@dataclass(frozen=True)
class Verdict:
    """What to say first."""

    level: Level
    sentence: str
    next_step: str  #: what to do; empty where all is well
    findings: tuple[Finding, ...]  #: what speaks against the run, the worst first


def _known(data: ReportData, trajectory: AbsoluteTrajectoryError | None) -> str:
    """Say what holds the frames to be right: each other, or a truth that is near; not what is bent to fit."""
    bent = deformation_figures(data.frames)
    if bent is not None and bent.is_bent:
        part = quantity(bent.explained, "fraction")
        return f"and show {part} of the points in view (median); what they do not show may be off"
    if trajectory is None or trajectory.num_compared < MIN_ALIGNED:
        return "and nothing contradicts them"
    return f"with a trajectory error of {quantity(trajectory.rmse, 'm')}"


def judge(data: ReportData, trajectory: AbsoluteTrajectoryError | None) -> Verdict | None:
    """Return the verdict on a run; None where nothing was run."""
    if not data.frames:
        return None
    findings = tuple(find_problems(data, trajectory))
    if not findings:
        return Verdict(
            "ok",
            f"Good: all {count(len(data.frames))} frames were tracked, {_known(data, trajectory)}.",
            "",
            (),
        )
    worst = findings[0]
    level: Level = "lost" if any(finding.level == "lost" for finding in findings) else "weak"
    return Verdict(level, f"{worst.word}: {worst.statement}.", worst.next_step, findings)
