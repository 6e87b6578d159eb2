"""All Lyapunov exponents of a sweep are drawn over its parameter."""

import numpy as np
from matplotlib.figure import Figure

import gearchaos
from gearchaos.figures import bifurcation
from gearchaos.plot import main

from .commands import LINEAR, small_config


def test_the_spectrum_of_exponents_is_a_diagram(tmp_path, capsys):
    changes = (*LINEAR[1::2], "outputs.exponents=true", "sweep.count=6")
    result = gearchaos.run(gearchaos.load_config(small_config(tmp_path), changes))
    drawn = bifurcation(Figure().subplots(), result, "lyapunov_exponents")
    # Each of the six lanes has two exponents.
    exponents = np.sort(drawn.points.get_ydata())
    np.testing.assert_array_equal(exponents, np.sort(result["lyapunov_exponents"].ravel()))
    assert result["lyapunov_exponents"].shape == (6, 2)
    result.save(tmp_path / "pair.h5")
    assert main([str(tmp_path / "pair.h5"), "--variable", "lyapunov_exponents"]) == 0
    assert "pair_lyapunov_exponents.png" in capsys.readouterr().out
