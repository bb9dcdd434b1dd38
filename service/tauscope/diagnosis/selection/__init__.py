"""Which effects enter the model: significant, confirmed on unused motion, and not replaced by a better one."""
