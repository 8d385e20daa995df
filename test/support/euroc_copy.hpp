#pragma once

#include <array>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/stamp.hpp"
#include "test/support/image_file.hpp"

namespace km {

/// The lists of a EuRoC recording, to be changed and written as a recording of its own. Images that
/// stay as they are become links.
class EurocCopy {
 public:
  struct Image {
    Stamp stamp = 0;
    std::filesystem::path file;
    double gain = 1.0;  ///< Grey values are multiplied by it.
  };
  struct Sample {
    Stamp stamp = 0;
    std::string values;  ///< As in the file.
  };

  std::array<std::vector<Image>, 2> cameras;
  std::vector<Sample> samples;

  /// `recording` holds mav0.
  explicit EurocCopy(const std::filesystem::path& recording)
      : mav0_(std::filesystem::absolute(recording) / "mav0") {
    for (const std::size_t c : {0U, 1U})
      for (auto& [stamp, name] : rows(folder(c) / "data.csv"))
        cameras[c].push_back({stamp, folder(c) / "data" / name});
    for (auto& [stamp, values] : rows(mav0_ / "imu0" / "data.csv"))
      samples.push_back({stamp, std::move(values)});
  }

  /// Writes it to `recording`, which is made.
  void write(const std::filesystem::path& recording) const {
    namespace fs = std::filesystem;
    const fs::path mav0 = recording / "mav0";
    fs::create_directories(mav0);
    for (const auto& entry : fs::directory_iterator(mav0_)) {
      const std::string name = entry.path().filename();
      if (name != "cam0" && name != "cam1" && name != "imu0")
        fs::create_symlink(entry.path(), mav0 / name);
    }
    for (const std::size_t c : {0U, 1U}) write_camera(cameras[c], mav0 / camera_name(c));
    fs::create_directories(mav0 / "imu0");
    fs::create_symlink(mav0_ / "imu0" / "sensor.yaml", mav0 / "imu0" / "sensor.yaml");
    std::ofstream list(mav0 / "imu0" / "data.csv");
    list << "#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n";
    for (const Sample& sample : samples) list << sample.stamp << ',' << sample.values << '\n';
  }

 private:
  static std::string camera_name(std::size_t camera) { return "cam" + std::to_string(camera); }
  [[nodiscard]] std::filesystem::path folder(std::size_t camera) const {
    return mav0_ / camera_name(camera);
  }

  // Stamps and what follows them.
  static std::vector<std::pair<Stamp, std::string>> rows(const std::filesystem::path& file) {
    std::ifstream in(file);
    if (!in) throw std::runtime_error(file.string() + ": cannot be read");
    std::vector<std::pair<Stamp, std::string>> rows;
    for (std::string line; std::getline(in, line);) {
      if (line.empty() || line[0] == '#') continue;
      if (line.back() == '\r') line.pop_back();
      const std::size_t comma = line.find(',');
      rows.emplace_back(std::stoll(line.substr(0, comma)), line.substr(comma + 1));
    }
    return rows;
  }

  void write_camera(const std::vector<Image>& images, const std::filesystem::path& to) const {
    std::filesystem::create_directories(to / "data");
    std::filesystem::create_symlink(mav0_ / to.filename() / "sensor.yaml", to / "sensor.yaml");
    std::ofstream list(to / "data.csv");
    list << "#timestamp [ns],filename\n";
    for (const Image& image : images) {
      const bool is_changed = image.gain != 1.0;
      const std::string name =
          std::to_string(image.stamp) + (is_changed ? ".png" : image.file.extension().string());
      list << image.stamp << ',' << name << '\n';
      if (is_changed)
        write_changed(image, to / "data" / name);
      else
        std::filesystem::create_symlink(image.file, to / "data" / name);
    }
  }

  static void write_changed(const Image& image, const std::filesystem::path& to) {
    cv::Mat pixels = read_pixels(image.file, DecodedPixels::kGray);
    pixels.convertTo(pixels, CV_8U, image.gain);  // saturates
    write_png(to, pixels);
  }

  std::filesystem::path mav0_;
};

/// Makes a EuRoC folder of links to the images of a recording at rest, in static_start, which are
/// apart from their calibration.
inline void link_static_start(const std::filesystem::path& recording,
                              const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const fs::path source = fs::absolute(recording);
  fs::create_directories(folder / "mav0");
  fs::create_directory_symlink(source / "mav0/imu0", folder / "mav0/imu0");
  for (const char* const camera : {"cam0", "cam1"}) {
    const fs::path made = folder / "mav0" / camera;
    fs::create_directories(made);
    fs::create_symlink(source / "mav0" / camera / "sensor.yaml", made / "sensor.yaml");
    fs::create_directory_symlink(source / "static_start" / camera, made / "data");
    std::set<std::string> names;
    for (const auto& file : fs::directory_iterator(made / "data"))
      names.insert(file.path().filename());
    std::ofstream list(made / "data.csv");
    for (const std::string& name : names) list << name.substr(0, 19) << ',' << name << '\n';
  }
}

}  // namespace km
