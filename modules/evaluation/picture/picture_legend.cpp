#include "modules/evaluation/picture/picture_legend.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>

namespace km {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFontScale = 0.5;
constexpr int kRow_px = 26;
constexpr int kPatch_px = 16;
constexpr int kGap_px = 8;
constexpr int kMargin_px = 12;
const cv::Scalar kBlack(0, 0, 0);

int text_width(const std::string& text) {
  int baseline = 0;
  return cv::getTextSize(text, kFont, kFontScale, 1, &baseline).width;
}

void write(cv::Mat3b& picture, const std::string& text, cv::Point at) {
  cv::putText(picture, text, at, kFont, kFontScale, kBlack, 1, cv::LINE_AA);
}

int width_of(const LegendEntry& entry) {
  return kPatch_px + kGap_px + text_width(entry.name) + 3 * kGap_px;
}

void draw(cv::Mat3b& strip, const LegendEntry& entry, cv::Point at) {
  const cv::Scalar color(entry.color[0], entry.color[1], entry.color[2]);
  if (entry.is_line) {
    const int middle = at.y + kPatch_px / 2;
    cv::line(strip, {at.x, middle}, {at.x + kPatch_px, middle}, color, 3, cv::LINE_AA);
  } else {
    const cv::Rect patch(at.x, at.y, kPatch_px, kPatch_px);
    cv::rectangle(strip, patch, color, cv::FILLED);
    cv::rectangle(strip, patch, cv::Scalar(90, 90, 90), 1);
  }
  write(strip, entry.name, {at.x + kPatch_px + kGap_px, at.y + kPatch_px - 3});
}

// 1, 2 or 5 times a power of ten, at most `limit`.
double round_length(double limit) {
  const double power = std::pow(10.0, std::floor(std::log10(limit)));
  return (limit >= 5.0 * power ? 5.0 : limit >= 2.0 * power ? 2.0 : 1.0) * power;
}

struct ScaleBar {
  int length_px = 0;
  std::string label;
};

ScaleBar scale_bar_of(const PictureView& view) {
  const double length_m = round_length(0.2 * view.width / view.scale);
  std::ostringstream label;
  label << length_m << " m";
  return {std::max(1, static_cast<int>(std::lround(length_m * view.scale))), label.str()};
}

void draw(cv::Mat3b& strip, const ScaleBar& bar, cv::Point at) {
  const cv::Point left = at + cv::Point(0, kPatch_px / 2);
  const cv::Point right = left + cv::Point(bar.length_px, 0);
  cv::line(strip, left, right, kBlack, 2);
  for (const cv::Point& end : {left, right})
    cv::line(strip, end + cv::Point(0, -4), end + cv::Point(0, 4), kBlack, 2);
  write(strip, bar.label, {right.x + kGap_px, at.y + kPatch_px - 3});
}

}  // namespace

cv::Mat3b draw_legend(const std::vector<LegendEntry>& entries, const PictureView& view) {
  const ScaleBar bar = scale_bar_of(view);
  std::vector<cv::Point> places;
  cv::Point next(kMargin_px, kGap_px);
  if (!view.perspective) next.x += bar.length_px + kGap_px + text_width(bar.label) + 4 * kGap_px;
  for (const LegendEntry& entry : entries) {
    if (next.x > kMargin_px && next.x + width_of(entry) > view.width)
      next = {kMargin_px, next.y + kRow_px};
    places.push_back(next);
    next.x += width_of(entry);
  }
  const bool empty = entries.empty() && view.perspective;
  cv::Mat3b strip(empty ? 0 : next.y + kRow_px, view.width, cv::Vec3b(255, 255, 255));
  if (!view.perspective) draw(strip, bar, {kMargin_px, kGap_px});
  for (std::size_t i = 0; i < entries.size(); ++i) draw(strip, entries[i], places[i]);
  return strip;
}

}  // namespace km
