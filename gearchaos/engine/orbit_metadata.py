"""The metadata that files of branches and files of boundaries have in common."""

from gearchaos.engine.provenance import provenance
from gearchaos.engine.run_plan import RunPlan
from gearchaos.models import Configuration
from gearchaos.outputs import names as known
from gearchaos.outputs.catalogue import SECTION_PART
from gearchaos.outputs.variable import Variable


def states_of(run: RunPlan) -> tuple[Variable, ...]:
    """Return the descriptions of the section of each state."""
    sections = run.lanes.model.catalogue.variables((), {SECTION_PART: run.lanes.states})
    return tuple(one for one in sections if one.name.startswith(known.SECTION))


def metadata_of(run: RunPlan, config: Configuration, longest: int) -> dict[str, str | int | float]:
    """Return the metadata of orbits that were followed with a plan.

    ``config``: the configuration from which they can be computed again; ``longest``: the longest
    period that was looked for.
    """
    facts = {
        "title": run.config.title,
        "model": run.config.kind,
        "effects": " ".join(run.config.scene.effects),
        "method": run.config.integration.method,
        "steps_per_period": run.plan.steps_per_period,
        "excitation_period": run.lanes.repeats_after,
        "longest_period": longest,
        **provenance(0.0),
        "configuration_resolved": config.resolved_toml(),
    }
    # The time was not measured.
    del facts["wall_time_seconds"]
    return facts
