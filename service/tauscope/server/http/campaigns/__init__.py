"""Campaigns: from a robot to an identified model in one request."""
