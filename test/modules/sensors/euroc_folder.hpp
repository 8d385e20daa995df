#pragma once

#include "modules/sensors/node/open_folder.hpp"
#include "test/support/image_file.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {

/// A temporary folder with a small EuRoC recording without faults. It has 8 stereo pairs of 32x24
/// px at 20 Hz from 10 s on, and inertial samples at 200 Hz from 8.5 s to 11 s. Tests corrupt its
/// files one at a time.
class EurocFolder {
 public:
  static constexpr std::int64_t kFirstImage = 10'000'000'000;
  static constexpr std::int64_t kImagePeriod = 50'000'000;
  static constexpr std::int64_t kFirstImu = 8'500'000'000;
  static constexpr std::int64_t kImuPeriod = 5'000'000;
  static constexpr int kPairs = 8;
  static constexpr int kImuSamples = 501;

  explicit EurocFolder(const std::string& extension = ".png") {
    for (const char* camera : {"cam0", "cam1"}) {
      write_list(camera, 1, extension);
      for (int i = 0; i < kPairs; ++i)
        write_pixels(side_image(camera, i, extension),
                     cv::Mat(24, 32, CV_8UC1, cv::Scalar(10 * (i + 1))));
    }
    write("cam0/sensor.yaml", camera_yaml(0.0));
    write("cam1/sensor.yaml", camera_yaml(0.1));
    write("imu0/sensor.yaml", imu_yaml());
    write("imu0/data.csv", imu_csv());
  }

  static std::int64_t image_stamp(int i) { return kFirstImage + i * kImagePeriod; }

  const fs::path& root() const { return folder_.path(); }
  fs::path mav0() const { return root() / "mav0"; }
  fs::path image(const std::string& camera, int i) const { return mav0() / side_image(camera, i); }

  void write(const std::string& relative, const std::string& text) const {
    folder_.write("mav0/" + relative, text);
  }
  std::string read(const std::string& relative) const { return folder_.read("mav0/" + relative); }
  /// Replaces the first `from` of a file; the file must contain it.
  void replace(const std::string& relative, const std::string& from, const std::string& to) const {
    std::string text = read(relative);
    text.replace(text.find(from), from.size(), to);  // throws if it is not there
    write(relative, text);
  }

  /// Writes depth0 with an image every `every` frames, all at `depth` units, a scale of 1 mm.
  void add_depth(int every = 1, int depth = 2000) const {
    write_list("depth0", every);
    for (int i = 0; i < kPairs; i += every)
      write_pixels(side_image("depth0", i), cv::Mat(24, 32, CV_16UC1, cv::Scalar(depth)));
    write("depth0/sensor.yaml", depth_yaml());
  }
  /// Writes label0 with an image every `every` frames, all of class `id`.
  void add_labels(int every = 1, int id = 3) const {
    write_list("label0", every);
    for (int i = 0; i < kPairs; i += every)
      write_pixels(side_image("label0", i), cv::Mat(24, 32, CV_8UC1, cv::Scalar(id)));
  }
  /// An RGB-D recording: depth in place of the right camera.
  void make_rgbd(int depth_every = 1) const {
    fs::remove_all(mav0() / "cam1");
    add_depth(depth_every);
  }
  static std::string side_image(const std::string& sensor, int i,
                                const std::string& extension = ".png") {
    return sensor + "/data/" + std::to_string(image_stamp(i)) + extension;
  }
  void write_pixels(const std::string& relative, const cv::Mat& pixels) const {
    fs::create_directories((mav0() / relative).parent_path());
    write_png(mav0() / relative, pixels);
  }

  static std::string depth_yaml() {
    std::string text = camera_yaml(0.0);
    text.replace(text.find("camera"), 6, "depth");
    return text + "depth_scale: 0.001\nmin_range_m: 0.4\nmax_range_m: 20.0\nbaseline_m: 0.08\n";
  }
  static std::string camera_yaml(double x_m) {
    return "sensor_type: camera\n"
           "T_BS:\n"
           "  cols: 4\n"
           "  rows: 4\n"
           "  data: [0, -1, 0, " +
           std::to_string(x_m) +
           ",\n"
           "         1, 0, 0, 0.2, 0, 0, 1, 0.3,\n"
           "         0, 0, 0, 1]\n"
           "rate_hz: 20\n"
           "resolution: [32, 24]\n"
           "camera_model: pinhole\n"
           "intrinsics: [30.0, 31.0, 16.0, 12.0] #fu, fv, cu, cv\n"
           "distortion_model: radial-tangential\n"
           "distortion_coefficients: [-0.2, 0.05, 0.001, 0.002]\n";
  }
  static std::string imu_yaml() {
    return "sensor_type: imu\n"
           "T_BS:\n"
           "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
           "rate_hz: 200\n"
           "gyroscope_noise_density: 1.6e-04\n"
           "gyroscope_random_walk: 1.9e-05\n"
           "accelerometer_noise_density: 2.0e-3\n"
           "accelerometer_random_walk: 3.0e-3\n";
  }
  static std::string imu_csv() {
    std::string text = "#timestamp [ns],wx,wy,wz,ax,ay,az\n";
    for (int i = 0; i < kImuSamples; ++i)
      text += std::to_string(kFirstImu + i * kImuPeriod) + ",0.1,0.2,0.3,1.0,2.0,9.8\n";
    return text;
  }

 private:
  void write_list(const std::string& sensor, int every,
                  const std::string& extension = ".png") const {
    std::string list = "#timestamp [ns],filename\n";
    for (int i = 0; i < kPairs; i += every) {
      const std::string stamp = std::to_string(image_stamp(i));
      list += stamp + ',' + stamp + extension + '\n';
    }
    write(sensor + "/data.csv", list);
  }

  TemporaryFolder folder_;
};

/// Checks that all numbers of a rig are those of sensors.
inline void check_rig(const SensorRig& rig) {
  for (const Camera& camera : rig.stereo.cameras) {
    CHECK(camera.T_body_cam.matrix().allFinite());
    CHECK(std::isfinite(camera.fx * camera.fy * camera.cx * camera.cy));
    CHECK(camera.width * camera.height > 0);
    CHECK(camera.lens.max_bearing() >= 0.0);
    const auto bearing = camera.unproject({camera.cx, camera.cy});
    CHECK((!bearing || bearing->allFinite()));
  }
  CHECK(std::isnormal(rig.imu.gyro_noise_density * rig.imu.gyro_noise_density));
  CHECK(std::isnormal(rig.imu.accel_noise_density * rig.imu.accel_noise_density));
}

/// The remaining packets.
inline std::vector<SensorPacket> packets_of(DatasetReader& reader) {
  std::vector<SensorPacket> packets;
  while (auto packet = reader.next()) packets.push_back(std::move(*packet));
  return packets;
}

/// A recording read to its end.
struct Outcome {
  std::vector<SensorPacket> packets;
  ReaderReport report;
};

inline Outcome read(const EurocFolder& folder, const FolderOptions& options = {}) {
  FolderReader reader = open_folder(folder.root(), options);
  Outcome outcome{packets_of(reader), {}};
  outcome.report = reader.report();
  return outcome;
}

}  // namespace km
