"""Level-set fluid-structure interaction that anybody can run, check and trust."""
