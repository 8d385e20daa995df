#include <regex>

#include "test/support/test.hpp"

// The layers of the tree, by what files include (the linker checks the rest: a pure module links
// neither threads nor DDS nor YAML):
//   modules/core        Eigen, nlohmann-json and the standard library; its rooms: those before them
//   modules/<m>         core, its own folder, and the modules listed below
//   runtime             core, security
//   modules/<m>/node    its own module, core, runtime
//   apps/lab/<library>  core, its own folder, and the modules listed below
//   apps, test          everything; of apps/lab only tests and apps/lab itself
// The laboratory links only libraries that are installed.
// Everywhere: what takes seconds to compile, JSON, is no header's to include.

namespace km {
namespace {

constexpr const char* kLab = "apps/lab/";

// Modules an algorithm may use beside core and itself.
const std::map<std::string, std::set<std::string>> kModuleUses = {
    {"absolute_fixes", {"recordings"}},
    {"constellations", {"objects", "outlier_rejection"}},
    {"dense_sensing", {"images"}},
    {"diagnosis", {"evaluation", "images", "place_recognition", "recordings", "sensors", "vio"}},
    {"loop_closure", {"images", "place_recognition"}},
    {"place_recognition", {"images"}},
    {"localization", {"loop_closure", "place_recognition"}},
    {"vio", {"images"}},
    {"rbcd", {"robust", "session", "tree_newton"}},
    {"robust", {"outlier_rejection", "tree_newton"}},
    {"ros_dds", {"images", "mesh", "objects", "recordings"}},
    {"sensors", {"images", "recordings"}},
    {"session", {"robust", "tree_newton"}},
    {"evaluation", {"charts", "mesh", "objects"}},
    {"simulation", {"images", "mesh"}},
    {"semantic_mapping", {"mesh"}},
    {"team_map", {"mesh", "semantic_mapping"}},
    {"map_2d", {"mesh"}},
    {"mesh_deformation", {"mesh"}},
    {"objects", {"mesh", "mesh_deformation"}},
    {"view", {"images", "mesh", "objects"}},
};

// The rooms of modules/core, from the lowest.
const std::vector<std::string> kCoreRooms = {"", "io", "geometry", "camera", "map", "data"};

// "modules/core/io/json.hpp" -> 1, "modules/core/ids.hpp" -> 0.
std::ptrdiff_t core_room(const fs::path& path) {
  const std::string folder = path.parent_path().filename().generic_string();
  return std::ranges::find(kCoreRooms, folder == "core" ? "" : folder) - kCoreRooms.begin();
}

std::vector<std::string> includes_of(const fs::path& file) {
  static const std::regex pattern(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<std::string> found;
  std::ifstream stream(file);
  std::smatch match;
  for (std::string line; std::getline(stream, line);)
    if (std::regex_search(line, match, pattern)) found.push_back(match[1]);
  return found;
}

bool is_source(const fs::path& file) {
  return file.extension() == ".hpp" || file.extension() == ".cpp";
}

// "modules/vio/vio.hpp" and "apps/lab/vio/vio.hpp" -> "vio"; empty for other paths.
std::string module_of(const std::string& path) {
  for (const std::string root : {"modules/", kLab})
    if (path.starts_with(root))
      return path.substr(root.size(), path.find('/', root.size()) - root.size());
  return {};
}

bool is_lab(const std::string& path) {
  return path.starts_with(kLab);
}

bool joins_runtime(const fs::path& file) {
  return file.parent_path().filename() == "node";
}

bool is_process_level(const std::string& header) {
  static const std::set<std::string> threads = {"thread", "mutex",  "condition_variable",
                                                "atomic", "future", "shared_mutex"};
  return threads.contains(header) || header.starts_with("yaml-cpp/") ||
         header.starts_with("dds/") || header.starts_with("CLI/");
}

// Why `file` may not include `header`, or nothing.
std::string violation(const fs::path& file, const std::string& header) {
  const std::string own = module_of(file.generic_string());
  const std::string used = module_of(header);
  const bool in_runtime = file.generic_string().starts_with("runtime/");
  const bool is_own_lab = is_lab(file.generic_string()) && is_lab(header) && used == own;
  if ((header.starts_with("apps/") && !is_own_lab) || header.starts_with("test/"))
    return "a lower layer";
  if (in_runtime)
    return used.empty() || used == "core" || used == "security"
               ? ""
               : "runtime uses only core and security";
  if (header.starts_with("runtime/"))
    return joins_runtime(file) ? "" : "only folders node use runtime";
  if (is_process_level(header))
    return joins_runtime(file) ? "" : "algorithms own no threads, DDS, YAML or command lines";
  if (own == "core" && used == "core" && core_room(header) > core_room(file)) return "a later room";
  if (used.empty() || used == "core" || used == own) return "";
  const auto allowed = kModuleUses.find(own);
  return allowed != kModuleUses.end() && allowed->second.contains(used) ? "" : "another module";
}

TEST_CASE("Every include obeys the layers") {
  std::size_t files = 0;
  for (const char* root : {"modules", "runtime", "apps/lab/simulation"})
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
      if (!is_source(entry.path())) continue;
      ++files;
      for (const std::string& header : includes_of(entry.path())) {
        CAPTURE(entry.path().string(), header);
        CHECK(violation(entry.path(), header) == "");
      }
    }
  CHECK(files > 20);  // run from the root of the repository
}

TEST_CASE("No room has more than 25 headers") {
  std::map<fs::path, int> headers;
  for (const char* root : {"modules", "runtime", "apps"})
    for (const auto& entry : fs::recursive_directory_iterator(root))
      if (entry.path().extension() == ".hpp") ++headers[entry.path().parent_path()];
  CHECK(headers.size() > 20);
  for (const auto& [room, count] : headers) {
    CAPTURE(room);
    CHECK(count <= 25);
  }
}

TEST_CASE("Only tests and the laboratory include headers of the laboratory") {
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator("apps")) {
    if (!is_source(entry.path()) || is_lab(entry.path().generic_string())) continue;
    ++files;
    for (const std::string& header : includes_of(entry.path())) {
      CAPTURE(entry.path().string(), header);
      CHECK_FALSE(is_lab(header));
    }
  }
  CHECK(files > 20);
}

TEST_CASE("The record of a run does not depend on the messages of ROS") {
  for (const std::string& header : includes_of("apps/robot/run_record.hpp"))
    CHECK_FALSE(header.starts_with("modules/ros_dds/"));
}

std::vector<std::string> matches(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), regex), end; match != end; ++match)
    found.push_back((*match)[1]);
  return found;
}

// Targets of the tree that CMake files of the laboratory name, except for their own and those with
// the name they have when installed.
std::set<std::string> internal_targets(const std::string& lab_text) {
  std::set<std::string> names;
  for (const std::string& name : matches(lab_text, R"(\b(km_[a-z_]+)\b)")) names.insert(name);
  for (const std::string& own : matches(lab_text, R"(km_module\(([a-z_]+))"))
    names.erase("km_" + own);
  for (const char* function : {"km_module", "km_app", "km_group_sources"}) names.erase(function);
  return names;
}

TEST_CASE("The laboratory links only libraries that are installed") {
  std::string text;
  for (const auto& entry : fs::recursive_directory_iterator("apps/lab"))
    if (entry.path().filename() == "CMakeLists.txt") {
      std::ifstream stream(entry.path());
      text.append(std::istreambuf_iterator<char>(stream), {});
    }
  for (const std::string& name : internal_targets(text)) FAIL_CHECK(name);
  CHECK_FALSE(matches(text, "(kimera_multi::[a-z_]+)").empty());
  // CMake refuses kimera_multi::<name> unless modules/install.cmake exports it.
  CHECK(internal_targets("km_module(a LINK km_b kimera_multi::c)\nkm_app(d LINK km_a)") ==
        std::set<std::string>{"km_b"});
}

// An exception in a std::thread ends the process without a report; GuardedThread reports it.
TEST_CASE("Nodes and the runtime start threads only as GuardedThread") {
  const std::set<std::string> own_threads = {"runtime/guarded_thread.hpp", "runtime/thread.hpp",
                                             "runtime/unblocked_output.hpp"};
  for (const char* root : {"modules", "runtime"})
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
      const std::string file = entry.path().generic_string();
      if (!is_source(entry.path()) || own_threads.contains(file)) continue;
      std::ifstream stream(entry.path());
      const std::string text(std::istreambuf_iterator<char>(stream), {});
      CAPTURE(file);
      CHECK(matches(text, R"((std::j?thread\b(?!::)|std::async\b))").empty());
    }
}

TEST_CASE("No header of the programs includes all of JSON") {
  for (const char* root : {"modules", "runtime", "apps"})
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
      if (entry.path().extension() != ".hpp") continue;
      CAPTURE(entry.path().string());
      for (const std::string& header : includes_of(entry.path()))
        CHECK(header != "nlohmann/json.hpp");
    }
}

TEST_CASE("The layer rules refuse what they are for") {
  CHECK_FALSE(violation("modules/vio/vio.cpp", "runtime/node.hpp").empty());
  CHECK_FALSE(violation("modules/vio/vio.cpp", "thread").empty());
  CHECK_FALSE(violation("modules/vio/vio_node.cpp", "runtime/node.hpp").empty());
  CHECK_FALSE(violation("modules/sensors/euroc_reader.cpp", "yaml-cpp/yaml.h").empty());
  CHECK_FALSE(violation("modules/vio/vio.cpp", "modules/loop_closure/verifier.hpp").empty());
  CHECK_FALSE(
      violation("modules/vio/node/vio_node.cpp", "modules/sensors/node/sensors_node.hpp").empty());
  CHECK_FALSE(violation("runtime/log.hpp", "modules/vio/vio.hpp").empty());
  CHECK_FALSE(violation("modules/vio/vio.cpp", "apps/lab/simulation/world/world.hpp").empty());
  CHECK_FALSE(violation("apps/lab/simulation/world/world.cpp", "thread").empty());
  CHECK_FALSE(violation("apps/lab/simulation/a.cpp", "apps/lab/pgo/b.hpp").empty());
  CHECK_FALSE(violation("apps/lab/simulation/a.cpp", "modules/vio/vio.hpp").empty());
  CHECK(violation("apps/lab/simulation/a.cpp", "apps/lab/simulation/b.hpp").empty());
  CHECK(violation("modules/vio/node/vio_node.cpp", "runtime/node.hpp").empty());
  CHECK(violation("runtime/dds/codec.hpp", "modules/core/ids.hpp").empty());
  CHECK(violation("modules/core/data/odometry.hpp", "modules/core/io/bytes.hpp").empty());
  CHECK_FALSE(violation("modules/core/io/bytes.hpp", "modules/core/data/odometry.hpp").empty());
}

}  // namespace
}  // namespace km
