"""The physics of bodies: each answers four verbs (blend, push, hold, move); they know no scene."""
