#include "apps/simulate/simulation_options.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <thread>

#include "apps/simulate/options_file.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/simulation/dataset/number_text.hpp"

namespace km {
namespace {

constexpr double kMaxDuration_s = 24.0 * 3600.0;

const std::map<std::string, WorldKind> kWorlds = {
    {"city", WorldKind::kCity}, {"camp", WorldKind::kCamp}, {"vicon_room", WorldKind::kViconRoom}};
const std::map<std::string, CameraKind> kCameras = {{"stereo", CameraKind::kStereo},
                                                    {"rgbd", CameraKind::kRgbd}};
const std::map<std::string, ImageFormat> kFormats = {{"jpg", ImageFormat::kJpeg},
                                                     {"png", ImageFormat::kPng}};

// An option whose values have names; others are refused with the list of names.
template <typename Enum>
CLI::Option* choice(CLI::App& app, const char* name, Enum& value,
                    const std::map<std::string, Enum>& names, const char* help) {
  std::set<std::string> words;
  for (const auto& entry : names) words.insert(entry.first);
  return app
      .add_option_function<std::string>(
          name, [&value, &names](const std::string& word) { value = names.at(word); }, help)
      ->check(CLI::IsMember(words));
}

// CLI::Range lets NaN pass.
CLI::Validator between(double min, double max) {
  return {[min, max](const std::string& text) -> std::string {
            const auto value = parse_double(text);
            if (value && min <= *value && *value <= max) return {};
            return "'" + text + "' is not a number from " + number_text(min) + " to " +
                   number_text(max);
          },
          number_text(min) + " .. " + number_text(max)};
}

// CLI11 reads -1 as the largest seed.
std::string check_seed(const std::string& text) {
  const bool digits = !text.empty() && text.size() <= 19 &&
                      text.find_first_not_of("0123456789") == std::string::npos;
  return digits ? std::string() : "'" + text + "' is not a whole number of at most 19 digits";
}

// "752x480"
std::string parse_resolution(const std::string& text, SimulationOptions& options) {
  int width = 0, height = 0, end = 0;
  const bool ok = std::sscanf(text.c_str(), "%5dx%5d%n", &width, &height, &end) == 2 &&
                  static_cast<std::size_t>(end) == text.size();
  if (!ok || width < 16 || height < 16 || width > 8192 || height > 8192)
    return "'" + text + "' is not WIDTHxHEIGHT with both from 16 to 8192";
  options.width = width;
  options.height = height;
  return {};
}

void define_recorded_mode(CLI::App& app, SimulationOptions& options) {
  const char* const group = "Recorded motion";
  app.add_option("--trajectory", options.truths,
                 "True poses of recorded flights, one file per robot: EuRoC's state CSV or TUM "
                 "text, also gzipped; in the frame of the world")
      ->check(CLI::ExistingFile)
      ->group(group);
  app.add_option("--imu", options.imus, "The recorded inertial data, one CSV per --trajectory")
      ->check(CLI::ExistingFile)
      ->group(group);
  app.add_option("--names", options.names, "Names of the robots (default: the files')")
      ->group(group);
  app.add_option("--start", options.start_s, "First image [s since the first true pose]")
      ->check(between(0.0, kMaxDuration_s))
      ->group(group);
  app.add_option("--end", options.end_s, "Last image [s], 0: the end of the flight")
      ->check(between(0.0, kMaxDuration_s))
      ->group(group);
}

void define_images(CLI::App& app, SimulationOptions& options) {
  choice(app, "--rig", options.cameras, kCameras, "Cameras of each robot (default: stereo)");
  app.add_option_function<std::string>(
         "--resolution", [](const std::string&) {}, "Of the images [px] (default: 752x480)")
      ->check(CLI::Validator(
          [&options](const std::string& text) { return parse_resolution(text, options); }, "WxH"));
  app.add_option("--rate", options.rate_hz, "Images per second")
      ->check(between(0.1, 200.0))
      ->capture_default_str();
  app.add_flag("--depth", options.depth, "Also depth images of the left camera (16 bit, mm)");
  app.add_option("--depth-rate", options.depth_rate_hz,
                 "Depth images per second, the rate divided by a whole number (default: the rate)")
      ->check(between(0.1, 200.0));
  app.add_flag("--ideal-depth", options.ideal_depth, "Depth without noise and holes");
  app.add_flag("--labels", options.labels, "Also class ids of the left camera's pixels");
  app.add_flag("--color", options.color, "Also colour images of the left camera");
  app.add_flag("--motion-blur", options.motion_blur, "Smear images along their motion");
  choice(app, "--image-format", options.format, kFormats,
         "jpg: quality 92, as recordings were stored (default), or png");
}

}  // namespace

void define(CLI::App& app, SimulationOptions& options) {
  app.set_config("--config", "", "File of options, see config/simulation/")
      ->check(CLI::Validator(
          [&app](const std::string& file) {
            return file.empty() ? std::string() : problems_of_options_file(app, file);
          },
          "FILE"));
  app.allow_config_extras(CLI::config_extras_mode::error);
  choice(app, "--world", options.world, kWorlds, "What there is to see")->required();
  app.add_option("--robots", options.robots, "How many robots move through it")
      ->check(CLI::Range(1, 99))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Of everything random: the same seed, the same bytes")
      ->check(CLI::Validator(check_seed, "NUMBER"))
      ->capture_default_str();
  app.add_option("--duration", options.duration_s, "Of the recordings [s]")
      ->check(between(0.5, kMaxDuration_s))
      ->capture_default_str();
  define_images(app, options);
  define_recorded_mode(app, options);
  app.add_option("--output", options.output,
                 "Folder of the recordings; one that was stopped goes on")
      ->required();
  app.add_option("--threads", options.threads, "That render (default: one per processor)")
      ->check(CLI::Range(1, 256));
}

namespace {

// "V1_02_medium" for "V1_02_medium.csv.gz", the folder's name for ".../V1_01/mav0/x/data.csv".
std::string recording_name(const std::filesystem::path& file) {
  std::filesystem::path path = std::filesystem::absolute(file);
  std::string name = path.filename().string();
  while (name == "data.csv" || name == "mav0" || name == "state_groundtruth_estimate0") {
    path = path.parent_path();
    name = path.filename().string();
  }
  return name.substr(0, name.find('.'));
}

void complete_recorded(SimulationOptions& options) {
  if (options.imus.size() != options.truths.size())
    throw std::invalid_argument("--trajectory names " + std::to_string(options.truths.size()) +
                                " files, --imu " + std::to_string(options.imus.size()) +
                                ": recorded motion needs one of each per robot");
  if (options.names.empty())
    for (const auto& file : options.truths) options.names.push_back(recording_name(file));
  if (options.names.size() != options.truths.size())
    throw std::invalid_argument("--names needs one name per --trajectory");
  if (options.end_s > 0.0 && options.end_s <= options.start_s)
    throw std::invalid_argument("--end is not after --start");
  options.robots = static_cast<int>(options.truths.size());
}

void complete_names(const SimulationOptions& options) {
  std::set<std::string> seen;
  for (const std::string& name : options.names) {
    const bool is_folder = !name.empty() && name.front() != '.' &&
                           std::all_of(name.begin(), name.end(), [](unsigned char c) {
                             return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
                           });
    if (!is_folder)
      throw std::invalid_argument("robot name '" + name +
                                  "' is not made of letters, digits, _, - and .");
    if (!seen.insert(name).second)
      throw std::invalid_argument("two robots are named " + name + "; tell them apart by --names");
  }
}

}  // namespace

SimulationOptions completed(SimulationOptions options) {
  if (options.is_recorded()) {
    complete_recorded(options);
  } else {
    if (!options.imus.empty() || !options.names.empty() || options.start_s > 0.0 ||
        options.end_s > 0.0)
      throw std::invalid_argument("--imu, --names, --start and --end need --trajectory");
    for (int i = 0; i < options.robots; ++i) options.names.push_back("robot" + std::to_string(i));
  }
  complete_names(options);
  if (options.cameras == CameraKind::kRgbd) options.depth = true;
  if (!options.depth && (options.depth_rate_hz > 0.0 || options.ideal_depth))
    throw std::invalid_argument("--depth-rate and --ideal-depth need --depth or --rig rgbd");
  if (options.depth_rate_hz <= 0.0) options.depth_rate_hz = options.rate_hz;
  const double steps = options.rate_hz / options.depth_rate_hz;
  if (steps < 1.0 || std::abs(steps - std::round(steps)) > 1e-6)
    throw std::invalid_argument("--rate " + number_text(options.rate_hz) +
                                " is not a multiple of --depth-rate " +
                                number_text(options.depth_rate_hz));
  if (options.threads == 0)
    options.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  return options;
}

const char* name_of(WorldKind world) {
  if (world == WorldKind::kCity) return "city";
  return world == WorldKind::kCamp ? "camp" : "vicon_room";
}

const char* name_of(CameraKind cameras) {
  return cameras == CameraKind::kStereo ? "stereo" : "rgbd";
}

ParameterList parameters(const SimulationOptions& options) {
  const auto yes = [](bool value) { return std::string(value ? "yes" : "no"); };
  ParameterList list = {{"world", name_of(options.world)},
                        {"seed", std::to_string(options.seed)},
                        {"robots", std::to_string(options.robots)}};
  if (options.is_recorded()) {
    list.emplace_back("start", number_text(options.start_s));
    list.emplace_back("end", number_text(options.end_s));
  } else {
    list.emplace_back("duration", number_text(options.duration_s));
  }
  list.emplace_back("rig", name_of(options.cameras));
  list.emplace_back("resolution",
                    std::to_string(options.width) + 'x' + std::to_string(options.height));
  list.emplace_back("rate", number_text(options.rate_hz));
  list.emplace_back("depth", yes(options.depth));
  if (options.depth) {
    list.emplace_back("depth-rate", number_text(options.depth_rate_hz));
    list.emplace_back("ideal-depth", yes(options.ideal_depth));
  }
  list.emplace_back("labels", yes(options.labels));
  list.emplace_back("color", yes(options.color));
  list.emplace_back("motion-blur", yes(options.motion_blur));
  list.emplace_back("image-format", options.format == ImageFormat::kJpeg ? "jpg" : "png");
  return list;
}

std::string command_line(const SimulationOptions& options) {
  std::string text = "kimera_multi_simulate";
  for (const auto& [name, value] : parameters(options)) {
    if (value == "no" || (options.is_recorded() && name == "robots")) continue;
    text += " --" + name + (value == "yes" ? "" : ' ' + value);
  }
  const auto add = [&text](const char* name, const auto& values, const auto& shown) {
    if (values.empty()) return;
    text += name;
    for (const auto& value : values) text += ' ' + shown(value);
  };
  const auto file_name = [](const std::filesystem::path& file) { return file.filename().string(); };
  add(" --trajectory", options.truths, file_name);
  add(" --imu", options.imus, file_name);
  if (options.is_recorded())
    add(" --names", options.names, [](const std::string& name) { return name; });
  return text + " --output DIR";
}

}  // namespace km
