#include "apps/shipped_file.hpp"

#include <vector>

#include "modules/core/config.hpp"
#include "modules/core/io/input_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Folders of the files that come with the program.
std::vector<fs::path> config_folders() {
  const fs::path program = program_folder();
  return {"config", program / "../../config", program / "../share/kimera_multi"};
}

}  // namespace

fs::path find_shipped_file(const std::string& name, const char* key) {
  const std::string start = std::string(key) + ": ";
  if (name.empty()) throw ConfigError(start + "names no file");
  std::vector<fs::path> places{fs::path(name)};
  for (const fs::path& root : config_folders()) places.push_back(root / name);
  std::string tried;
  for (const fs::path& place : places) {
    if (is_file(place)) return place;
    tried += "\n  " + place.lexically_normal().string();
    if (fs::is_directory(place)) tried += " (a folder)";
    if (place.is_absolute() && place == name) break;
  }
  throw ConfigError(start + "no file " + name + "; looked for" + tried);
}

fs::path find_named_file(const std::string& folder, const std::string& name) {
  if (is_file(name)) return name;
  std::vector<fs::path> named;
  std::string known;
  for (const fs::path& root : config_folders()) {
    std::vector<fs::path> files = entries_of(root / folder);
    std::erase_if(files, [](const fs::path& file) { return file.extension() != ".yaml"; });
    for (const fs::path& file : files) {
      const std::string stem = file.stem();
      if (stem == name) return file;
      if (stem.ends_with(name)) named.push_back(file);
      known += (known.empty() ? "" : ", ") + stem;
    }
    if (!files.empty()) break;
  }
  if (named.size() == 1) return named.front();
  throw ConfigError("no file " + name + ", and " + (named.empty() ? "none" : "several") +
                    " of this name in " + folder + ": " + known);
}

}  // namespace km
