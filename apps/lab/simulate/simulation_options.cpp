#include "apps/lab/simulate/simulation_options.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <thread>
#include <tuple>

#include "apps/program_options.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

template <typename T>
constexpr bool kIsList = false;
template <typename T>
constexpr bool kIsList<std::vector<T>> = true;

// Visitor that makes each field an option of the command line. A given value is stored under the
// same key, as if a file contained it.
class OptionFields : public FieldVisitor<OptionFields> {
 public:
  OptionFields(CLI::App& app, ConfigSection& given) : app_(app), given_(given) {}

  template <typename T, typename Accepted>
  void visit(const char* key, const T& value, const Accepted& accepted, std::string text) {
    const std::string name = std::string("--").append(key);
    const auto give = [this, key](const auto& written) {
      given_.values.insert_or_assign(key, ConfigValue{YAML::Node(written), "", kCommandLine});
    };
    if (required_.contains(key)) text += " (required)";
    if (!accepted.text().empty()) text += "; " + accepted.text();
    if constexpr (std::is_same_v<T, bool>)
      app_.add_flag_function(
          name, [give](std::int64_t count) { give(count > 0); }, text);
    else if constexpr (kIsList<T>)
      app_.add_option_function<std::vector<std::string>>(name, give, text);
    else
      app_.add_option_function<std::string>(name, give, text)
          ->default_str(required_.contains(key) ? "" : yaml_text(value, accepted));
  }
  void required(std::initializer_list<const char*> keys) {
    required_.insert(keys.begin(), keys.end());
  }

 private:
  CLI::App& app_;
  ConfigSection& given_;
  std::set<std::string> required_;
};

// "752x480" as width and height.
std::optional<std::pair<int, int>> parse_resolution(const std::string& text) {
  int width = 0, height = 0, end = 0;
  const bool ok = std::sscanf(text.c_str(), "%5dx%5d%n", &width, &height, &end) == 2 &&
                  static_cast<std::size_t>(end) == text.size();
  if (!ok || std::min(width, height) < 16 || std::max(width, height) > 8192) return std::nullopt;
  return std::pair(width, height);
}

// Reads the file of options if there is one, then overrides it with the command line.
void read_options(const std::string& file, const ConfigSection& given, SimulationOptions& options) {
  ConfigProblems problems;
  const ConfigContext context{problems};
  ConfigSection section = given;
  if (!file.empty()) section.values.merge(read_section(load_yaml(file), "", file, context).values);
  fill_config(section, "", context, options);
  try {
    options.effects = load_effects(options.difficulty, options.settings);
    options.effects.sensor.motion_blur |= options.motion_blur;
  } catch (const ConfigError& error) {
    problems.others += std::string(error.what()) + '\n';
  }
  problems.finish();
}

}  // namespace

bool is_resolution(const std::string& text) {
  return parse_resolution(text).has_value();
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
      throw std::invalid_argument("two robots are named " + name + "; distinguish them by --names");
  }
}

// Fills in derived values: names, the number of robots and the rate of depth images.
void complete(SimulationOptions& options) {
  std::tie(options.width, options.height) = parse_resolution(options.resolution).value();
  if (options.is_recorded()) {
    complete_recorded(options);
  } else {
    if (!options.imus.empty() || !options.names.empty())
      throw std::invalid_argument("--imu and --names need --trajectory");
    for (int i = 0; i < options.robots; ++i) options.names.push_back("robot" + std::to_string(i));
  }
  complete_names(options);
  if (options.cameras == CameraKind::kRgbd) options.depth = true;
  if (!options.depth && options.depth_rate_hz > 0.0)
    throw std::invalid_argument("--depth-rate needs --depth or --rig rgbd");
  if (options.depth_rate_hz <= 0.0) options.depth_rate_hz = options.rate_hz;
  const double steps = options.rate_hz / options.depth_rate_hz;
  if (steps < 1.0 || std::abs(steps - std::round(steps)) > 1e-6)
    throw std::invalid_argument("--rate " + shortest_text(options.rate_hz) +
                                " is not a multiple of --depth-rate " +
                                shortest_text(options.depth_rate_hz));
  if (options.threads == 0)
    options.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

}  // namespace

void define(CLI::App& app, SimulationOptions& options) {
  struct Given {
    explicit Given(CLI::App& app) : fields(app, given) {}
    std::string file;
    ConfigSection given{kCommandLine, {}};
    OptionFields fields;
  };
  const auto line = std::make_shared<Given>(app);
  app.add_option("--config", line->file,
                 "File of options, or the name of one in config/simulation/, such as city")
      ->transform(named_file("simulation"));
  options.visit_fields(line->fields);
  app.callback([line, &options] {
    try {
      read_options(line->file, line->given, options);
      complete(options);
    } catch (const CommandLineError& error) {
      throw CLI::ValidationError(error.what(), CLI::ExitCodes::ValidationError);
    } catch (const std::invalid_argument& error) {
      if (!line->file.empty()) throw;
      throw CLI::ValidationError(error.what(), CLI::ExitCodes::ValidationError);
    }
  });
}

namespace {

// Visitor that lists every option except for those that the bytes do not depend on.
class ParameterFields : public FieldVisitor<ParameterFields> {
 public:
  explicit ParameterFields(ParameterList& list) : list_(list) {}

  template <typename T, typename Accepted>
  void visit(const char* key, const T& value, const Accepted& accepted, const std::string&) {
    const std::string name = key;
    if constexpr (std::is_same_v<T, std::string>)
      list_.emplace_back(name, value);
    else if constexpr (!kIsList<T>)
      if (name != "output" && name != "threads")
        list_.emplace_back(name, yaml_text(value, accepted));
  }

 private:
  ParameterList& list_;
};

}  // namespace

ParameterList parameters(SimulationOptions options) {
  ParameterList list;
  ParameterFields fields(list);
  options.visit_fields(fields);
  for (const std::string& setting : options.settings)
    list.emplace_back(setting.substr(0, setting.find('=')), setting);
  return list;
}

}  // namespace km
