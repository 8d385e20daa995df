#pragma once

#include <filesystem>
#include <memory>

#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/pose_stream.hpp"

namespace km {

/// Reads the body poses of an odometry from a text file of TUM's format:
/// `t[s] x y z qx qy qz qw`. Each
/// row may also have the 36 numbers of its covariance, row by row, as in
/// geometry_msgs/PoseWithCovariance. Faulty rows are skipped and counted in `report`. Throws
/// DatasetError if there is no row.
[[nodiscard]] PoseStream read_pose_file(const std::filesystem::path& file, ReaderReport& report);

/// The packets of another reader with the poses of a file. Frames without a pose in the file are
/// skipped and counted.
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
