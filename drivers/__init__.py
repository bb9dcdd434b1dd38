"""One small protocol for servos and drives; Dynamixel and CANopen will stand behind it. Nothing of service in here."""
