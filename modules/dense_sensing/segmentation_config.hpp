#pragma once

#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of SegmentationNetwork. Field names are the YAML keys below `segmentation:`.
struct SegmentationConfig {
  static constexpr const char* kSection = "segmentation";

  /// File in ONNX format: one image in, scores of every class (1 x classes x height x width) or
  /// class numbers (1 x 1 x height x width, 1 x height x width) out. Empty: none.
  std::string network;

  /// Table of the labels, `name,red,green,blue,alpha,id` as of Kimera-Semantics. Empty: that of the
  /// recording.
  std::string palette;

  /// The image as the network takes it: resized, given `channels` equal channels (cameras here are
  /// grey), and turned into (level - mean) * scale, level being 0 to 255.
  int width_px = 512;
  int height_px = 256;
  int channels = 3;
  double mean = 0.0;
  double scale = 1.0 / 255.0;

  /// Label of each class of the network, in order. Empty: a class's number is its label. Classes
  /// beyond the list are unknown and counted.
  std::vector<std::string> label_map;

  void visit_fields(auto& visitor) {
    visitor.field("network", network, "ONNX file; empty: none");
    visitor.field("palette", palette, "CSV file; empty: the recording's");
    visitor.field("width_px", width_px, {1, 8192}, "[px] of the network's input");
    visitor.field("height_px", height_px, {1, 8192}, "[px] of the network's input");
    visitor.field("channels", channels, {1, 3}, "of the network's input, 1 or 3");
    visitor.field("mean", mean, {-1000.0, 1000.0}, "[grey levels] taken off");
    visitor.field("scale", scale, {1e-6, 1000.0}, "then multiplied with");
    visitor.field("label_map", label_map, "label of each class; empty: the same numbers");
  }
};

}  // namespace km
