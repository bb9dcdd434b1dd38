"""Arms of Dynamixel servos: Protocol 2.0 over a serial port, position under a cap of current, or current."""
