"""Control of a system by its load, once per mesh period: the controller and its trial."""
