"""The float64 reference: twins of the GLSL includes, and whole frames by rays and brute-force shading."""
