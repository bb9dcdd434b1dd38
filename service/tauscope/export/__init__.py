"""An identified model in the formats of controllers and simulators, findings included as far as each can hold them."""
