"""What Tauscope does for a user, one module a verb: `Request`, `perform(request, files, progress)`, `Result`.

The command line, the workers of the service and the fleet call these, so that a verb has the same options everywhere.
"""
