# What type checkers and editors see of the names that are imported on first use.
from gearchaos import iso1328 as iso1328
from gearchaos.controlling.controller import Controller as Controller
from gearchaos.dynamics.controllers import ControlSettings as ControlSettings
from gearchaos.engine.response import respond as respond
from gearchaos.engine.running import run as run
from gearchaos.errors import ConfigurationError as ConfigurationError
from gearchaos.errors import FigureError as FigureError
from gearchaos.errors import FileError as FileError
from gearchaos.errors import GearchaosError as GearchaosError
from gearchaos.models import Configuration as Configuration
from gearchaos.models import load_config as load_config
from gearchaos.results.reading.result import Result as Result
from gearchaos.results.reading.result import open_result as open_result
from gearchaos.system import System as System
from gearchaos.version import software_version as software_version

__version__: str
