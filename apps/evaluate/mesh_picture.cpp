#include "apps/evaluate/mesh_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>

#include "apps/evaluate/surface_image.hpp"

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

namespace {

constexpr int kFiner = 2;  // drawn this many times larger in both directions, then averaged
constexpr double kInFront_m = 0.05;
constexpr LabelledMesh::Color kClay = {214, 210, 200};
constexpr LabelledMesh::Color kUnknown = {150, 150, 150};
// Colours of robots and of lines, 0xRRGGBB.
constexpr std::array kRobots = {0xE66150, 0x5096DC, 0x6EBE5A, 0xB482D2,
                                0xFAAA46, 0x46C8D2, 0xAA7D6E, 0xF08CC8};
constexpr std::array kLines = {0xD62728, 0x1F77B4, 0x147814, 0x9428BD,
                               0xFF7F0E, 0x00A0B4, 0x6E3C32, 0xE33CB4};

// Colour of element i of a list.
LabelledMesh::Color color_in(const std::array<int, 8>& list, std::size_t i) {
  const auto rgb = static_cast<std::uint32_t>(list[i % list.size()]);
  return {static_cast<std::uint8_t>(rgb >> 16U), static_cast<std::uint8_t>(rgb >> 8U),
          static_cast<std::uint8_t>(rgb)};
}

cv::Vec3b bgr(const LabelledMesh::Color& color) {
  return {color[2], color[1], color[0]};
}

LabelledMesh::Color color_of(LabelId label, const LabelPalette& palette) {
  const LabelClass* found = label == 0 ? nullptr : palette.find(label);
  return found != nullptr ? found->color : kUnknown;
}

std::string name_of(const PictureScene& scene, std::size_t mesh) {
  return mesh < scene.names.size() ? scene.names[mesh] : "mesh " + std::to_string(mesh);
}

std::vector<LabelledMesh::Color> colors_of(const PictureScene& scene, std::size_t i,
                                           PictureColor color) {
  const LabelledMesh& mesh = scene.meshes[i];
  const std::size_t count = mesh.vertices.size();
  if (color == PictureColor::kShade) return std::vector(count, kClay);
  if (color == PictureColor::kRobot) return std::vector(count, color_in(kRobots, i));
  if (color == PictureColor::kOwn) {
    if (mesh.colors.size() != count)
      throw std::invalid_argument(name_of(scene, i) + ": its vertices have no colours");
    return mesh.colors;
  }
  if (mesh.labels.size() != count)
    throw std::invalid_argument(name_of(scene, i) + ": its vertices have no labels");
  std::vector<LabelledMesh::Color> colors;
  colors.reserve(count);
  for (const LabelId label : mesh.labels) colors.push_back(color_of(label, scene.palette));
  return colors;
}

// All meshes as one, without colours.
LabelledMesh merged(const PictureScene& scene) {
  LabelledMesh all;
  for (const LabelledMesh& mesh : scene.meshes) all.append(mesh);
  if (all.faces.empty()) throw std::invalid_argument("no mesh to draw has a face");
  return all;
}

// The visible labels, by descending number of pixels.
std::vector<LegendEntry> label_entries(const LabelledMesh& mesh, const SurfaceImage& surface,
                                       const LabelPalette& palette) {
  std::array<std::size_t, 256> pixels{};
  for (const std::uint32_t face : surface.faces)
    if (face != SurfaceImage::kNone) ++pixels[mesh.face_label(face)];
  std::vector<std::size_t> labels;
  for (std::size_t label = 0; label < pixels.size(); ++label)
    if (pixels[label] > 0) labels.push_back(label);
  std::stable_sort(labels.begin(), labels.end(),
                   [&](std::size_t a, std::size_t b) { return pixels[a] > pixels[b]; });
  std::vector<LegendEntry> entries;
  for (const std::size_t label : labels) {
    const auto id = static_cast<LabelId>(label);
    const LabelClass* found = palette.find(id);
    const std::string name = id == 0 ? "unknown" : "label " + std::to_string(label);
    entries.push_back({found != nullptr ? found->name : name, bgr(color_of(id, palette)), false});
  }
  return entries;
}

std::vector<LegendEntry> legend_of(const PictureScene& scene, const LabelledMesh& mesh,
                                   const SurfaceImage& surface, PictureColor color) {
  std::vector<LegendEntry> entries;
  if (color == PictureColor::kLabel) entries = label_entries(mesh, surface, scene.palette);
  if (color == PictureColor::kRobot)
    for (std::size_t i = 0; i < scene.meshes.size(); ++i)
      entries.push_back({name_of(scene, i), bgr(color_in(kRobots, i)), false});
  for (std::size_t i = 0; i < scene.lines.size(); ++i)
    entries.push_back({scene.lines[i].name, bgr(color_in(kLines, i)), true});
  return entries;
}

constexpr int kShift = 4;  // bits of a pixel's fraction in OpenCV's drawing

cv::Point fixed_point(const Eigen::Vector3d& pixel) {
  constexpr double kLimit = 1e6;  // within an int after the shift
  const auto fixed = [=](double value) {
    return static_cast<int>(
        std::lround((std::clamp(value, -kLimit, kLimit) - 0.5) * (1 << kShift)));
  };
  return {fixed(pixel.x()), fixed(pixel.y())};
}

void draw_path(cv::Mat3b& picture, const PictureLine& line, const cv::Vec3b& color,
               const PictureView& view) {
  const cv::Scalar ink(color[0], color[1], color[2]);
  const cv::Scalar white(255, 255, 255);
  const auto in_sight = [&](const Eigen::Vector3d& pixel) {
    return !view.perspective || pixel.z() > kInFront_m;
  };
  // White below, so that the path is visible on any colour.
  for (const auto& [thickness, shade] : {std::pair(5, white), std::pair(2, ink)})
    for (std::size_t i = 1; i < line.points.size(); ++i) {
      const Eigen::Vector3d from = view.project(line.points[i - 1]);
      const Eigen::Vector3d to = view.project(line.points[i]);
      if (in_sight(from) && in_sight(to))
        cv::line(picture, fixed_point(from), fixed_point(to), shade, thickness, cv::LINE_AA,
                 kShift);
    }
  if (line.points.empty()) return;
  const auto mark = [&](const Eigen::Vector3d& point, const cv::Scalar& inside) {
    const Eigen::Vector3d pixel = view.project(point);
    if (!in_sight(pixel)) return;
    cv::circle(picture, fixed_point(pixel), 6 << kShift, inside, cv::FILLED, cv::LINE_AA, kShift);
    cv::circle(picture, fixed_point(pixel), 6 << kShift, ink, 2, cv::LINE_AA, kShift);
  };
  mark(line.points.front(), white);
  mark(line.points.back(), ink);
}

}  // namespace

cv::Mat3b draw_meshes(const PictureScene& scene, const PictureView& view, PictureColor color) {
  std::vector<LabelledMesh::Color> colors;
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    const auto own = colors_of(scene, i, color);
    colors.insert(colors.end(), own.begin(), own.end());
  }
  const LabelledMesh mesh = merged(scene);
  const PictureView finer = view.enlarged(kFiner);
  const SurfaceImage surface = rasterise(mesh, finer);
  cv::Mat3b large = paint(mesh, surface, finer, colors, color == PictureColor::kOwn);
  shade(large, mesh, surface, finer);
  cv::Mat3b picture;
  cv::resize(large, picture, {view.width, view.height}, 0, 0, cv::INTER_AREA);
  for (std::size_t i = 0; i < scene.lines.size(); ++i)
    draw_path(picture, scene.lines[i], bgr(color_in(kLines, i)), view);
  const cv::Mat3b legend = draw_legend(legend_of(scene, mesh, surface, color), view);
  if (!legend.empty()) picture.push_back(legend);
  return picture;
}

}  // namespace km
