#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>

namespace km {

/// A YAML file, and what is wrong with it so far.
struct YamlSource {
  std::filesystem::path file;
  std::string& problems;  ///< A line each; of several files.

  /// At the node, or of the file if there is none.
  void problem(const YAML::Node& at, const std::string& text) {
    const std::string line = at ? " line " + std::to_string(at.Mark().line + 1) : "";
    problems += file.string() + line + ": " + text + '\n';
  }
};

/// The keys of one map. What was not asked for is a problem; with `quick` those of its map `quick:`
/// come first.
class YamlKeys {
 public:
  YamlKeys(YamlSource& source, const YAML::Node& map, bool quick) : source_(source), map_(map) {
    if (!map_.IsMap()) {
      source_.problem(map_, "expected keys and values here");
      return;
    }
    const YAML::Node other = child_of(map_, "quick");
    known_.insert("quick");
    if (other && !other.IsMap()) source_.problem(other, "quick: expected keys and values");
    if (other && other.IsMap()) quick_ = other;
    use_quick_ = quick;
  }

  [[nodiscard]] YAML::Node child(const std::string& key) {
    known_.insert(key);
    const YAML::Node first = use_quick_ ? child_of(quick_, key) : YAML::Node(kUndefined);
    return first ? first : child_of(map_, key);
  }

  /// The value of `key` as T, if it is there.
  template <typename T>
  std::optional<T> get(const std::string& key, const char* expected) {
    const YAML::Node node = child(key);
    T value{};
    if (!node) return std::nullopt;
    if (YAML::convert<T>::decode(node, value)) return value;
    source_.problem(node, key + " is not " + expected);
    return std::nullopt;
  }

  /// The same; it is a problem if it is not there.
  template <typename T>
  T require(const std::string& key, const char* expected) {
    if (!child(key)) source_.problem(map_, key + " is missing");
    return get<T>(key, expected).value_or(T{});
  }

  void finish() {
    for (const YAML::Node& map : {map_, quick_})
      if (map.IsMap())
        for (const auto& entry : map)
          if (!known_.contains(entry.first.Scalar()))
            source_.problem(entry.first, "unknown key " + entry.first.Scalar());
  }

 private:
  static constexpr auto kUndefined = YAML::NodeType::Undefined;
  static YAML::Node child_of(const YAML::Node& map, const std::string& key) {
    return map.IsMap() ? map[key] : YAML::Node(kUndefined);
  }

  YamlSource& source_;
  YAML::Node map_;
  YAML::Node quick_;
  bool use_quick_ = false;
  std::set<std::string> known_;
};

}  // namespace km
