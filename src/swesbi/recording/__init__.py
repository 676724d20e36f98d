"""Raw shear wave recordings and context tables, and how they become observed stiffness curves."""
