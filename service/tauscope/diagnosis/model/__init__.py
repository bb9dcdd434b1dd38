"""The extended model: the identified one, the effects found beside it, and the torque that it leaves."""
