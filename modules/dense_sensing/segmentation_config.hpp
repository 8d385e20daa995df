#pragma once

#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of SegmentationNetwork.
struct SegmentationConfig {
  static constexpr const char* kSection = "segmentation";

  std::string network;
  std::string palette;
  int width_px = 512;
  int height_px = 256;
  int channels = 3;
  double mean = 0.0;
  double scale = 1.0 / 255.0;
  std::vector<std::string> label_map;

  void visit_fields(auto& visitor) {
    visitor.field(
        "network", network,
        "ONNX file; input: one image; output: scores of every class (1 x classes x height x width) "
        "or class numbers (1 x 1 x height x width, 1 x height x width); empty: none");
    visitor.field("palette", palette,
                  "CSV file of the labels, name,red,green,blue,alpha,id as in Kimera-Semantics; "
                  "empty: the palette of the recording");
    visitor.field("width_px", width_px, {1, 8192},
                  "[px] width of the network's input, to which images are resized");
    visitor.field("height_px", height_px, {1, 8192}, "[px] height of the network's input");
    visitor.field(
        "channels", channels, {1, 3},
        "number of channels of the network's input, all equal because images are grey; 1 or 3");
    visitor.field("mean", mean, {-1000.0, 1000.0},
                  "[grey levels, 0 to 255] subtracted from the image");
    visitor.field("scale", scale, {1e-6, 1000.0}, "factor applied after the subtraction of mean");
    visitor.field("label_map", label_map,
                  "label of each class, in order; further classes are unknown and counted; empty: "
                  "label = class number");
  }
};

}  // namespace km
