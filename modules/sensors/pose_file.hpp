#pragma once

#include <filesystem>
#include <memory>

#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/pose_stream.hpp"

namespace km {

/// Poses of the body by an odometry, in a text of TUM's form: `t[s] x y z qx qy qz qw`, each with
/// or without the 36 numbers of its covariance, row by row, as geometry_msgs/PoseWithCovariance has
/// it. Rows that break are left out and counted in `report`. Throws DatasetError without a row.
[[nodiscard]] PoseStream read_pose_file(const std::filesystem::path& file, ReaderReport& report);

/// The packets of another reader with the poses of a file in them; frames of which it does not tell
/// the pose are left out and counted.
class PoseFileReader final : public DatasetReader {
 public:
  /// Throws DatasetError for a file without a pose.
  PoseFileReader(std::unique_ptr<DatasetReader> reader, const std::filesystem::path& file);

  [[nodiscard]] const SensorRig& rig() const override { return reader_->rig(); }
  using DatasetReader::next;
  [[nodiscard]] std::optional<SensorPacket> next(const ChooseUse& choose) override;
  [[nodiscard]] ReaderReport report() const override;
  [[nodiscard]] std::size_t pair_count() const override { return reader_->pair_count(); }
  [[nodiscard]] std::vector<std::string> remarks() const override { return reader_->remarks(); }
  [[nodiscard]] bool gives_poses() const override { return true; }
  void stop() noexcept override { reader_->stop(); }

 private:
  std::unique_ptr<DatasetReader> reader_;
  std::string name_;
  ReaderReport report_;
  PoseStream poses_;
};

}  // namespace km
