// Colour operations.
