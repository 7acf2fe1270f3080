"""What people write down for r2c2r: prompts, overrides, settings, and the manifest that comes back, each described once.

The command line and the app read through these models, and `r2c2r schema` prints them as JSON Schema.
"""
