"""Models of the JSON documents: prompts, overrides, settings, requests, and the manifest.

The command line and the app read documents through these models, and `r2c2r schema` prints them as JSON Schema.
"""
