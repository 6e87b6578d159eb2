"""From a configuration to computed lanes, on this machine or on a cluster."""
