"""The real video model classes with random weights, small enough for tests: 64 px images, one layer of everything."""

from typing import Any

import torch
import transformers

from r2c2r_core.segment.learned.sam_video import EDGETAM, SAM2, SAM3, Family, VideoModel, on_device

torch.set_num_threads(1)
_SIDE = 64
_HIERA = {
    "model_type": "sam2_hiera_det_model",
    "hidden_size": 8,
    "embed_dim_per_stage": [8, 16, 32, 64],
    "num_attention_heads_per_stage": [1, 1, 1, 1],
    "blocks_per_stage": [1, 2, 1, 1],
    "global_attention_blocks": [2],
    "window_size_per_stage": [8, 4, 4, 2],
    "image_size": [_SIDE, _SIDE],
}


def tiny(family: Family, dtype: Any = torch.float32) -> VideoModel:
    """A model of the family on the CPU, always with the same weights."""
    torch.manual_seed(0)
    model = {SAM2.model: _sam2, EDGETAM.model: _edgetam, SAM3.model: _sam3}[family.model]()
    return on_device(model, family, torch.device("cpu"), dtype)


def sam2_config() -> Any:
    vision = transformers.Sam2VisionConfig(
        backbone_config=_HIERA, backbone_channel_list=[64, 32, 16, 8], backbone_feature_sizes=_maps(_SIDE, 16)
    )
    return transformers.Sam2VideoConfig(
        vision_config=vision, memory_attention_feed_forward_hidden_size=32, **_common(_SIDE, 16)
    )


def _sam2() -> Any:
    return transformers.Sam2VideoModel(sam2_config())


def _edgetam() -> Any:
    """EdgeTAM with a pyramid of plain convolutions instead of timm's RepViT: timm needs torchvision, which is not installed."""
    vision = transformers.EdgeTamVisionConfig(
        backbone_config=_HIERA, backbone_channel_list=[64, 32, 16, 8], backbone_feature_sizes=_maps(_SIDE, 16)
    )
    model = transformers.EdgeTamVideoModel(
        transformers.EdgeTamVideoConfig(
            vision_config=vision,
            memory_attention_mlp_hidden_size=32,
            memory_attention_rope_k_sizes=[2, 2],
            perceiver_resampler_num_layers=1,
            perceiver_resampler_num_latents=4,
            perceiver_resampler_num_latents_2d=4,
            **_common(_SIDE, 16),
        )
    )
    model.vision_encoder.backbone = _Pyramid()
    return model


def _sam3() -> Any:
    side = 56  # a multiple of its patch of 14
    vision = transformers.Sam3VisionConfig(
        backbone_config={
            "model_type": "sam3_vit_model",
            "hidden_size": 32,
            "intermediate_size": 32,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "image_size": side,
            "pretrain_image_size": side,
            "window_size": 4,
            "global_attn_indexes": [1],
        }
    )
    return transformers.Sam3TrackerVideoModel(
        transformers.Sam3TrackerVideoConfig(
            vision_config=vision, memory_attention_feed_forward_hidden_size=32, **_common(side, 14)
        )
    )


def _common(side: int, stride: int) -> dict[str, Any]:
    return {
        "memory_attention_num_layers": 1,
        "memory_attention_rope_feat_sizes": [side // stride] * 2,
        "image_size": side,
        "prompt_encoder_config": {"image_size": side},
        "mask_decoder_config": {"mlp_dim": 32, "num_hidden_layers": 1, "iou_head_hidden_dim": 32},
    }


def _maps(side: int, stride: int) -> list[list[int]]:
    return [[side * k // stride] * 2 for k in (4, 2, 1)]


class _Pyramid(torch.nn.Module):
    """Feature maps at strides 4, 8, 16 and 32, as timm's features_only models return them."""

    def __init__(self) -> None:
        super().__init__()
        widths = [3, 8, 16, 32, 64]
        strides = [4, 2, 2, 2]
        self.steps = torch.nn.ModuleList(
            torch.nn.Conv2d(a, b, s, s) for a, b, s in zip(widths[:-1], widths[1:], strides, strict=True)
        )

    def forward(self, pixel_values: Any, **_: Any) -> Any:
        maps = []
        for step in self.steps:
            pixel_values = torch.relu(step(pixel_values))
            maps.append(pixel_values)
        return transformers.modeling_outputs.BaseModelOutput(last_hidden_state=maps)
