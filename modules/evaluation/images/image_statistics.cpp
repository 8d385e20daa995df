#include "modules/evaluation/images/image_statistics.hpp"

#include <stdexcept>
#include <string>

#include "modules/images/image_view.hpp"

namespace km {
namespace {

const ImageStatisticsOptions& checked(const ImageStatisticsOptions& options) {
  if (options.stride < 1)
    throw std::invalid_argument("image statistics: stride " + std::to_string(options.stride) +
                                " is not positive");
  if (!(options.max_step_s > 0.0))
    throw std::invalid_argument("image statistics: max_step_s is not positive");
  return options;
}

}  // namespace

ImageStatistics::ImageStatistics(const StereoRig& rig, const ImageStatisticsOptions& options)
    : options_(checked(options)), tracks_(options.stride, options.max_step_s), stereo_(rig) {}

void ImageStatistics::add(const StereoFrame& frame) {
  const KltImage left = make_klt_image(view(frame.left));
  const auto corners = corners_of(left.image);
  const double flow_px = tracks_.add(frame.stamp, left, corners);
  levels_.add(left.image, view(frame.right), flow_px);
  if (frames_ % static_cast<std::size_t>(options_.stride) == 0)
    stereo_.add(frame.stamp, left,
                frame.right.pixels.empty() ? KltImage{} : make_klt_image(view(frame.right)),
                corners);
  still_.add(frame.stamp, left, corners);
  ++frames_;
}

void ImageStatistics::add_still(const StereoFrame& frame) {
  const KltImage left = make_klt_image(view(frame.left));
  still_.add(frame.stamp, left, corners_of(left.image));
}

std::vector<ImageFigure> ImageStatistics::figures() const {
  std::vector<ImageFigure> figures;
  FigureList(figures, "sequence").add("frames", static_cast<double>(frames_), 0);
  tracks_.append_to(figures);
  stereo_.append_to(figures);
  levels_.append_to(figures);
  still_.append_to(figures);
  return figures;
}

}  // namespace km
