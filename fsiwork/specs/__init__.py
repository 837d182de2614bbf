"""What a scene is made of: frozen, checked data, no solver. `fsiwork.scene` puts the pieces together."""
