#include "client/lab/results.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "common/image/flip.h"

namespace lightmill::lab {
namespace {

using nlohmann::json;

/// A field that is not finite is null in JSON.
double number_in(const json& object, const char* field) {
  const json& value = object.at(field);
  return value.is_null() ? std::numeric_limits<double>::infinity() : value.get<double>();
}

LabResult from_json(const json& object) {
  LabResult result;
  result.key = object.at("key").get<std::string>();
  result.scene = object.at("scene").get<std::string>();
  result.method = object.at("method").get<std::string>();
  result.seed = object.at("seed").get<std::uint64_t>();
  result.level = object.at("level").get<std::size_t>();
  result.samples = object.at("samples").get<std::uint64_t>();
  result.thread_seconds = number_in(object, "thread_seconds");
  result.seconds = number_in(object, "seconds");
  result.error.rel_mse = number_in(object, "rel_mse");
  result.error.rel_mse_trimmed = number_in(object, "rel_mse_trimmed");
  result.error.energy_ratio = number_in(object, "energy_ratio");
  result.error.smape = number_in(object, "smape");
  result.error.max_abs = number_in(object, "max_abs");
  result.flip = number_in(object, "flip");
  result.stated = number_in(object, "stated");
  result.stated_half_width = number_in(object, "stated_half_width");
  result.film_hash = object.at("film_hash").get<std::string>();
  return result;
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) {
    return text;
  }
  std::string out = "\"";
  for (const char c : text) {
    out += c == '"' ? "\"\"" : std::string(1, c);
  }
  return out + "\"";
}

}  // namespace

Status compare(const RgbImage& picture, const RgbImage& reference, LabResult& result) {
  LM_ASSIGN_OR_RETURN(result.error, compare_pictures(picture, reference));
  LM_ASSIGN_OR_RETURN(const std::vector<float> map, flip_map(picture, reference));
  result.flip = mean_flip(map);
  return ok_status();
}

json to_json(const LabResult& result) {
  return {{"key", result.key},
          {"scene", result.scene},
          {"method", result.method},
          {"seed", result.seed},
          {"level", result.level},
          {"samples", result.samples},
          {"thread_seconds", result.thread_seconds},
          {"seconds", result.seconds},
          {"rel_mse", result.error.rel_mse},
          {"rel_mse_trimmed", result.error.rel_mse_trimmed},
          {"energy_ratio", result.error.energy_ratio},
          {"smape", result.error.smape},
          {"max_abs", result.error.max_abs},
          {"flip", result.flip},
          {"stated", result.stated},
          {"stated_half_width", result.stated_half_width},
          {"film_hash", result.film_hash}};
}

Result<ResultSet> read_lines(std::string_view text) {
  ResultSet results;
  std::size_t number = 0;
  while (!text.empty()) {
    ++number;
    const std::string_view line = text.substr(0, text.find('\n'));
    const bool torn = line.size() == text.size();  // every complete line ends with a line feed
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    try {
      LabResult result = from_json(json::parse(line));
      results[result.key] = std::move(result);
    } catch (const json::exception&) {
      if (torn) {
        break;
      }
      return data_loss("line {} is not a result: delete it, and its picture is rendered again", number);
    }
  }
  return results;
}

std::string write_lines(const ResultSet& results, const std::vector<std::string>& order) {
  std::string text;
  std::set<std::string_view> written;
  for (const std::string& key : order) {
    const auto found = results.find(key);
    if (found != results.end() && written.insert(found->first).second) {
      text += to_json(found->second).dump() + "\n";
    }
  }
  for (const auto& [key, result] : results) {
    if (!written.contains(key)) {
      text += to_json(result).dump() + "\n";
    }
  }
  return text;
}

std::string to_csv(const std::vector<LabResult>& results) {
  std::string text =
      "scene,method,seed,level,samples,thread_seconds,seconds,rel_mse,rel_mse_trimmed,energy_ratio,smape,flip,max_abs,"
      "stated,stated_half_width,film_hash,key\n";
  for (const LabResult& r : results) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", quoted(r.scene), quoted(r.method),
                        r.seed, r.level, r.samples, r.thread_seconds, r.seconds, r.error.rel_mse,
                        r.error.rel_mse_trimmed, r.error.energy_ratio, r.error.smape, r.flip, r.error.max_abs, r.stated,
                        r.stated_half_width, r.film_hash, r.key);
  }
  return text;
}

}  // namespace lightmill::lab
