#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "modules/evaluation/picture/picture_view.hpp"

namespace km {

/// One entry of a legend: a patch or a line of this colour, and its name.
struct LegendEntry {
  std::string name;
  cv::Vec3b color;  ///< Blue, green, red.
  bool is_line = false;
};

/// A white strip as wide as the view: a bar of 1, 2 or 5 times a power of ten metres with its
/// length (not in perspective, where there is no one scale), and the entries, in as many rows as
/// they need.
[[nodiscard]] cv::Mat3b draw_legend(const std::vector<LegendEntry>& entries,
                                    const PictureView& view);

}  // namespace km
