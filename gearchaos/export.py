"""Write a result as a table, .csv or .parquet, or as arrays for MATLAB and Octave, .mat.

A table has a row per lane, and a column for each number of a lane; with --along section_point a row
per section point. CSV has units in brackets behind the headings, Parquet in the attributes that
pandas reads. Needs pip install gearchaos[export].
"""

from argparse import Namespace
from typing import Any

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError

ENDINGS = (".csv", ".parquet", ".mat")


def _export(options: Namespace) -> None:
    import numpy as np

    from gearchaos.results.files.atomic_file import check_output, replacing
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.tables import needed

    kind = options.output.lower().rpartition(".")[2]
    if not options.output.lower().endswith(ENDINGS):
        raise ConfigurationError(f"{options.output}: must end in {', '.join(ENDINGS)}")
    result = open_result(options.result)
    result = result.physical() if options.units == "physical" else result
    check_output(options.output, options.overwrite)
    with replacing(options.output, overwrite=options.overwrite) as partial:
        if kind == "mat":
            flags = {v.name: v.flags for v in result.variables.values() if v.flags}
            words = {f"{name}_meanings": np.array(flags[name], dtype=object) for name in flags}
            arrays: dict[str, Any] = {name: result[name] for name in result}
            arrays |= {**words, "metadata": result.metadata}
            needed("scipy.io").savemat(partial, arrays, appendmat=False)
        elif kind == "csv":
            frame = result.to_dataframe(*options.along)
            pure, units = ("", "1"), frame.attrs["units"]
            headings = {n: f"{n} [{units[n]}]" for n in units if units[n] not in pure}
            frame.rename(columns=headings).rename_axis(index=headings).to_csv(partial)
        else:
            needed("pyarrow")
            result.to_dataframe(*options.along).to_parquet(partial, engine="pyarrow")
    print(options.output, flush=True)


main = Command("export", __doc__, _export).start(__name__)
