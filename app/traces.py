"""Traces of requests and of jobs' stages, sent to an OpenTelemetry collector with `R2C2R_TRACES=otlp`.

FastAPI records traces of requests itself, given a provider. Without tracing, only OpenTelemetry's no-op interface is
imported. The collector's address and the service name are set by OpenTelemetry's own variables
(`OTEL_EXPORTER_OTLP_ENDPOINT`, `OTEL_SERVICE_NAME`):
https://opentelemetry.io/docs/specs/otel/configuration/sdk-environment-variables/
"""

from typing import Any

from fastapi.telemetry import TelemetryConfig
from opentelemetry.trace import NoOpTracerProvider, TracerProvider

from r2c2r_core.errors import EnvironmentProblem, InputError


def open_traces(kind: str) -> TracerProvider:
    """Trace provider selected by R2C2R_TRACES; raises InputError for another kind, EnvironmentProblem without OpenTelemetry."""
    if kind not in ("", "otlp"):
        raise InputError(f"R2C2R_TRACES {kind[:40]!r}: not otlp", hint="leave it out to take none")
    return exporting() if kind else NoOpTracerProvider()


def exporting(exporter: Any = None) -> TracerProvider:
    """Provider that sends traces to the collector, or the exporter; pending ones are flushed when the process ends."""
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import SERVICE_NAME, OTELResourceDetector, Resource
        from opentelemetry.sdk.trace import TracerProvider as Exporting
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError as error:
        raise EnvironmentProblem(f"R2C2R_TRACES: no module {error.name}", hint="pip install 'r2c2r[otel]'") from error
    provider = Exporting(resource=Resource({SERVICE_NAME: "r2c2r"}).merge(OTELResourceDetector().detect()))
    provider.add_span_processor(BatchSpanProcessor(exporter or OTLPSpanExporter()))
    return provider


def of_requests(provider: TracerProvider) -> TelemetryConfig:
    """FastAPI's telemetry configuration: durations of requests, without their content."""
    taken = not isinstance(provider, NoOpTracerProvider)
    return {"tracer_provider": provider, "tracing": taken, "operation_spans": taken, "metrics": False, "logs": False}
