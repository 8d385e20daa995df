#include "modules/sensors/stereo_pairs.hpp"

#include <string>
#include <utility>

#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/ordered_rows.hpp"

namespace km {
namespace {

struct ListedImage {
  Stamp stamp = 0;
  int line = 0;
  std::filesystem::path file;
};

std::vector<ListedImage> list_images(const std::filesystem::path& camera, ReaderReport& report) {
  std::vector<ListedImage> images;
  const std::filesystem::path list = camera / "data.csv";
  read_ordered_rows(list, 2, report, [&](Stamp stamp, const TextRow& row) {
    images.push_back({stamp, row.line, camera / "data" / row.fields[1]});
    return std::string();
  });
  if (images.empty()) throw DatasetError(list.string() + ": lists no image");
  return images;
}

}  // namespace

std::vector<StereoPairFile> list_euroc_pairs(const std::filesystem::path& mav0, double tolerance_s,
                                             ReaderReport& report) {
  const auto lefts = list_images(mav0 / "cam0", report);
  const auto rights = list_images(mav0 / "cam1", report);
  const auto lonely = [&](ReaderFault fault, const char* camera, const ListedImage& image) {
    report.add(fault, at_line(mav0 / camera / "data.csv", image.line) + ": " +
                          image.file.filename().string());
  };
  std::vector<StereoPairFile> pairs;
  auto left = lefts.begin();
  auto right = rights.begin();
  while (left != lefts.end() || right != rights.end()) {
    const bool no_left = left == lefts.end();
    const bool no_right = right == rights.end();
    const double offset_s = no_left || no_right ? 0.0 : seconds_between(left->stamp, right->stamp);
    if (no_right || offset_s > tolerance_s) {
      lonely(ReaderFault::kLeftWithoutRight, "cam0", *left++);
    } else if (no_left || offset_s < -tolerance_s) {
      lonely(ReaderFault::kRightWithoutLeft, "cam1", *right++);
    } else {
      pairs.push_back({left->stamp, left->file, right->file, left->line, {}, {}});
      ++left, ++right;
    }
  }
  if (pairs.empty())
    throw DatasetError(mav0.string() + ": no image of cam0 has one of cam1 within " +
                       std::to_string(tolerance_s) + " s");
  return pairs;
}

std::vector<StereoPairFile> list_euroc_lefts(const std::filesystem::path& mav0,
                                             ReaderReport& report) {
  std::vector<StereoPairFile> frames;
  for (ListedImage& left : list_images(mav0 / "cam0", report))
    frames.push_back({left.stamp, std::move(left.file), {}, left.line, {}, {}});
  return frames;
}

void list_beside(const std::filesystem::path& folder, std::filesystem::path StereoPairFile::*member,
                 double tolerance_s, std::vector<StereoPairFile>& frames, ReaderReport& report) {
  auto frame = frames.begin();
  for (ListedImage& image : list_images(folder, report)) {
    while (frame != frames.end() && seconds_between(frame->stamp, image.stamp) > tolerance_s)
      ++frame;
    if (frame == frames.end() || seconds_between(frame->stamp, image.stamp) < -tolerance_s) {
      report.add(ReaderFault::kImageWithoutFrame,
                 at_line(folder / "data.csv", image.line) + ": " + image.file.filename().string());
      continue;
    }
    (*frame++).*member = std::move(image.file);
  }
}

std::vector<StereoPairFile> list_keyframe_pairs(const std::filesystem::path& folder,
                                                ReaderReport& report) {
  std::vector<StereoPairFile> pairs;
  const std::filesystem::path list = folder / "pairs.csv";
  read_ordered_rows(list, 3, report, [&](Stamp stamp, const TextRow& row) {
    pairs.push_back({stamp, folder / row.fields[1], folder / row.fields[2], row.line, {}, {}});
    return std::string();
  });
  if (pairs.empty()) throw DatasetError(list.string() + ": lists no stereo pair");
  return pairs;
}

StereoPairResult load_stereo_pair(const StereoPairFile& files, const StereoRig& rig) {
  StereoPairResult result;
  result.frame.stamp = files.stamp;
  const std::pair<const std::filesystem::path&, GrayImage&> images[] = {
      {files.left, result.frame.left}, {files.right, result.frame.right}};
  const std::size_t count = rig.depth_source == DepthSource::kRightImage ? 2 : 1;
  for (std::size_t i = 0; i < count; ++i) {
    const PinholeCamera& camera = rig.cameras[i];
    ImageResult loaded = load_gray_image(images[i].first, camera.width, camera.height);
    if (loaded.status != ImageStatus::kOk) return {loaded.status, std::move(loaded.problem), {}};
    images[i].second = std::move(loaded.image);
  }
  return result;
}

}  // namespace km
