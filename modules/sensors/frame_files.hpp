#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/image_file.hpp"
#include "modules/sensors/synchrony.hpp"

namespace km {

/// Files of the images of a frame.
struct StereoPairFile {
  Stamp stamp = 0;               ///< Stamp of the left image.
  std::filesystem::path left;    ///< File of the left image.
  std::filesystem::path right;   ///< File of the right image; empty with an RGB-D rig.
  int line = 0;                  ///< Row of the left image in the list.
  std::filesystem::path depth;   ///< Empty if there is none.
  std::filesystem::path labels;  ///< Empty if there is none.
};

/// Stereo pairs, ascending, and the difference of their stamps.
struct StereoPairFiles {
  std::vector<StereoPairFile> pairs;
  Synchrony synchrony;
};

/// Keeps the frames of `part`. `recording`: path for messages. Precondition: `frames` is not empty.
/// Throws DatasetError if no frame is left, and std::invalid_argument for a part that is empty or
/// not a number.
void keep_part(const RecordingPart& part, const std::filesystem::path& recording,
               std::vector<StereoPairFile>& frames);

/// Throws DatasetError if `rig` needs depth images and no frame has one on disk. `recording`: path
/// for messages.
void check_depth_images(const std::filesystem::path& recording, const StereoRig& rig,
                        const std::vector<StereoPairFile>& frames);

/// The stereo pairs of a EuRoC folder: rows `stamp [ns], file` of cam0/data.csv and cam1/data.csv,
/// matched by stamps (see find_synchrony()). Faulty rows and images without a partner are counted
/// in `report`. Throws DatasetError if a list is missing or contains no image.
[[nodiscard]] StereoPairFiles list_euroc_pairs(const std::filesystem::path& mav0,
                                               ReaderReport& report);

/// The left images of a EuRoC folder alone, for an RGB-D rig. Faults and errors are those of
/// list_euroc_pairs().
[[nodiscard]] std::vector<StereoPairFile> list_euroc_lefts(const std::filesystem::path& mav0,
                                                           ReaderReport& report);

/// Assigns each image that `folder`/data.csv lists (depth0, label0) to the `member` of the frame
/// whose stamp is at most a millisecond away. There may be fewer images than frames. Images without
/// a frame are counted. Throws DatasetError if the list is missing or contains no image.
void list_beside(const std::filesystem::path& folder, std::filesystem::path StereoPairFile::*member,
                 std::vector<StereoPairFile>& frames, ReaderReport& report);

/// A stereo pair from disk, or the left image with an RGB-D rig, without depth and labels. Status
/// and problem are those of the first image that failed.
[[nodiscard]] LoadedImage<StereoFrame> load_stereo_pair(const StereoPairFile& files,
                                                        const StereoRig& rig);

/// Reads the depth and label images of a EuRoC folder: depth0, label0 and label_palette.csv.
/// Unusable images are counted and omitted. Const members are thread-safe.
class DepthAndLabelImages {
 public:
  /// Reads depth if there is a range, with images in units of `depth_scale_m`, and labels if
  /// `labels`. Throws DatasetError for a palette that cannot be read; ids need no palette.
  DepthAndLabelImages(const std::filesystem::path& mav0, const std::optional<DepthRange>& depth,
                      double depth_scale_m, bool labels);

  /// Finds the images of `frames`; see list_beside().
  void list(std::vector<StereoPairFile>& frames, ReaderReport& report) const;

  /// Reads the images of one frame.
  void load(const StereoPairFile& files, StereoFrame& frame, ReaderReport& report) const;

  /// Palette of the labels; empty without a file, and if no labels are read.
  [[nodiscard]] const LabelPalette& palette() const { return palette_; }

 private:
  void load_depth(const std::filesystem::path& file, StereoFrame& frame,
                  ReaderReport& report) const;
  void load_labels(const std::filesystem::path& file, StereoFrame& frame,
                   ReaderReport& report) const;

  std::filesystem::path mav0_;
  std::optional<DepthRange> depth_;
  double depth_scale_m_;
  bool labels_;
  LabelPalette palette_;
};

}  // namespace km
