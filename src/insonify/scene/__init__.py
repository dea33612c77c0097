"""What sound can meet: seabed, surface, targets, and the scatterers they offer."""
