#include "common/scene_io/gltf/gltf_pose.h"

#include <algorithm>
#include <cmath>

#include "common/base/number_text.h"
#include "common/base/text.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxValues = 20'000'000;  ///< numbers of all keyframes that are read

/// The keyframes around a moment.
struct Keyframes {
  std::size_t count = 0;  ///< of the sampler
  std::size_t before = 0, after = 0;
  double span = 0;      ///< seconds between the two
  double fraction = 0;  ///< of the span before the moment
};

/// Unit quaternions along the shorter arc between them. Both are x, y, z, w.
std::vector<double> slerp(const std::vector<double>& a, std::vector<double> b, double t) {
  double cosine = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    cosine += a[i] * b[i];
  }
  const double sign = cosine < 0 ? -1 : 1;
  const double angle = std::acos(std::min(std::abs(cosine), 1.0));
  const double sine = std::sin(angle);
  const double of_a = sine > 1e-6 ? std::sin((1 - t) * angle) / sine : 1 - t;
  const double of_b = sign * (sine > 1e-6 ? std::sin(t * angle) / sine : t);
  for (std::size_t i = 0; i < 4; ++i) {
    b[i] = of_a * a[i] + of_b * b[i];
  }
  return b;
}

/// Evaluates the samplers of an animation.
class Samplers {
 public:
  Samplers(const GltfData& data, double seconds) : data_(data), seconds_(seconds) {}

  /// The `width` numbers of a sampler at the moment: one vector of `width` components, or `width` scalars for weights.
  /// Nothing, with a fault, if its data are wrong.
  std::optional<std::vector<double>> value(const JsonNode& sampler, bool scalars, std::size_t width) {
    const std::optional<Keyframes> keys = keyframes(sampler["input"]);
    const std::string interpolation = sampler["interpolation"].text("LINEAR");
    const bool cubic = interpolation == "CUBICSPLINE";
    if (!keys) {
      return std::nullopt;
    }
    if (!cubic && interpolation != "LINEAR" && interpolation != "STEP") {
      skip(sampler["interpolation"],
           fmt::format("LINEAR, STEP or CUBICSPLINE is expected, got \"{}\"", short_text(interpolation)));
      return std::nullopt;
    }
    const JsonNode output = sampler["output"];
    const std::size_t elements = keys->count * (cubic ? 3 : 1) * (scalars ? width : 1);
    if (const std::size_t got = data_.count(output); got != elements) {
      skip(output, fmt::format("{} values are expected, got {}", elements, got));
      return std::nullopt;
    }
    if (data_.element("accessors", output)["sparse"].present()) {
      skip(output, "its values are sparse, which is not supported in animations");
      return std::nullopt;
    }
    const auto row = [&](std::size_t index) { return row_of(output, index, scalars, width); };
    if (keys->before == keys->after || interpolation == "STEP") {
      return row(cubic ? 3 * keys->before + 1 : keys->before);
    }
    const double t = keys->fraction;
    if (!cubic) {
      const std::vector<double> from = row(keys->before);
      std::vector<double> to = row(keys->after);
      if (width == 4 && !scalars) {
        return slerp(from, std::move(to), t);
      }
      for (std::size_t i = 0; i < width; ++i) {
        to[i] = from[i] + (to[i] - from[i]) * t;
      }
      return to;
    }
    // Each keyframe has an in-tangent, a value and an out-tangent (glTF 2.0, appendix C.5).
    const std::vector<double> from = row(3 * keys->before + 1), out = row(3 * keys->before + 2);
    const std::vector<double> in = row(3 * keys->after), to = row(3 * keys->after + 1);
    const double t2 = t * t, t3 = t2 * t;
    std::vector<double> value(width);
    for (std::size_t i = 0; i < width; ++i) {
      value[i] = (2 * t3 - 3 * t2 + 1) * from[i] + keys->span * (t3 - 2 * t2 + t) * out[i] + (3 * t2 - 2 * t3) * to[i] +
                 keys->span * (t3 - t2) * in[i];
    }
    return value;
  }

 private:
  static std::string short_text(const std::string& text) { return utf8_text(text.substr(0, 40)); }
  static void skip(const JsonNode& at, std::string_view what) { at.fault(what, "its animation is skipped"); }

  /// Counts numbers that are read. Reports an error if they are too many.
  bool reads(const JsonNode& at, std::size_t numbers) {
    values_ += numbers;
    if (values_ > kMaxValues) {
      at.fail(fmt::format("the animation needs more than {} numbers", kMaxValues));
    }
    return values_ <= kMaxValues;
  }

  /// Nothing, with a fault, if the times are wrong.
  std::optional<Keyframes> keyframes(const JsonNode& input) {
    const JsonNode accessor = data_.element("accessors", input);
    const auto [found, added] = keyframes_.try_emplace(accessor.path());
    if (!added) {
      return found->second;
    }
    if (!reads(input, data_.count(input))) {
      return std::nullopt;
    }
    std::vector<double> times;
    for (const auto& [time] : data_.vectors<1>(input)) {
      times.push_back(time);
    }
    if (!data_.status().ok()) {
      return std::nullopt;
    }
    if (times.empty() || !std::ranges::all_of(times, [](double time) { return std::isfinite(time); }) ||
        !std::ranges::is_sorted(times)) {
      skip(input, "ascending times are expected");
      return std::nullopt;
    }
    Keyframes keys{.count = times.size()};
    const auto next = static_cast<std::size_t>(std::ranges::upper_bound(times, seconds_) - times.begin());
    keys.before = next == 0 ? 0 : next - 1;
    keys.after = next == 0 ? 0 : std::min(next, times.size() - 1);
    keys.span = times[keys.after] - times[keys.before];
    keys.fraction = keys.span > 0 ? (seconds_ - times[keys.before]) / keys.span : 0;
    found->second = keys;
    return keys;
  }

  std::vector<double> row_of(const JsonNode& output, std::size_t row, bool scalars, std::size_t width) {
    std::vector<std::uint32_t> which(scalars ? width : 1);
    for (std::size_t i = 0; i < which.size(); ++i) {
      which[i] = static_cast<std::uint32_t>(row * which.size() + i);
    }
    if (!reads(output, width)) {
      return std::vector<double>(width);
    }
    std::vector<double> out;
    const auto append = [&](const auto& elements) {
      for (const auto& element : elements) {
        out.insert(out.end(), element.begin(), element.end());
      }
    };
    if (scalars) {
      append(data_.vectors<1>(output, which));
    } else if (width == 3) {
      append(data_.vectors<3>(output, which));
    } else {
      append(data_.vectors<4>(output, which));
    }
    out.resize(width);  // after an error it is empty
    return out;
  }

  const GltfData& data_;
  const double seconds_;
  std::map<std::string, std::optional<Keyframes>> keyframes_;  ///< by accessor
  std::size_t values_ = 0;
};

/// The animation of this name or number.
Result<JsonNode> find_animation(const GltfData& data, const std::string& wanted) {
  const JsonNode list = data.root()["animations"];
  std::string names;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string name = list.at(i)["name"].text();
    if (wanted.empty() || name == wanted) {
      return list.at(i);
    }
    if (i < 20) {
      names += fmt::format("{}{}", i == 0 ? "" : ", ", name.empty() ? fmt::format("{}", i + 1) : utf8_text(name));
    }
  }
  if (list.size() == 0) {
    return invalid_argument("the file has no animations: leave out --at and --animation");
  }
  if (const auto number = parse_number<std::uint64_t>(wanted); number && *number >= 1 && *number <= list.size()) {
    return list.at(*number - 1);
  }
  return invalid_argument("there is no animation {}. It has {}: {}{}", wanted, counted(list.size(), "animation"), names,
                          list.size() > 20 ? ", …" : "");
}

template <std::size_t n>
std::optional<std::array<double, n>> as_array(const std::optional<std::vector<double>>& value) {
  if (!value) {
    return std::nullopt;
  }
  std::array<double, n> out{};
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = std::isfinite((*value)[i]) ? std::clamp((*value)[i], -kMaxCoordinate, kMaxCoordinate) : 0;
  }
  return out;
}

std::size_t morph_targets(const GltfData& data, const JsonNode& node) {
  const JsonNode primitives = data.element("meshes", node["mesh"])["primitives"];
  return primitives.size() == 0 ? 0 : primitives.at(0)["targets"].size();
}

}  // namespace

Result<GltfPoses> poses_at(const GltfData& data, const AnimationMoment& moment) {
  LM_ASSIGN_OR_RETURN(const JsonNode animation, find_animation(data, moment.animation));
  GltfPoses poses;
  Samplers samplers(data, moment.seconds);
  std::vector<double> none;
  const JsonNode channels = animation["channels"];
  for (std::size_t i = 0; i < channels.size() && data.status().ok(); ++i) {
    const JsonNode target = channels.at(i)["target"], list = animation["samplers"];
    const JsonNode node = data.element("nodes", target["node"]);
    const std::optional<std::size_t> which = channels.at(i)["sampler"].index("samplers", list.size());
    if (!node.present() || !which) {
      continue;  // another extension may name the target
    }
    const JsonNode sampler = list.at(*which);
    const std::string path = target["path"].text();
    NodePose& pose = poses[node.path()];
    if (path == "translation") {
      pose.translation = as_array<3>(samplers.value(sampler, false, 3));
    } else if (path == "rotation") {
      pose.rotation = as_array<4>(samplers.value(sampler, false, 4));
      if (const auto& q = pose.rotation;
          q && !(std::hypot(std::hypot((*q)[0], (*q)[1]), std::hypot((*q)[2], (*q)[3])) > 1e-6)) {
        sampler["output"].fault("a unit quaternion is expected", "its animation is skipped");
        pose.rotation = std::nullopt;
      }
    } else if (path == "scale") {
      pose.scale = as_array<3>(samplers.value(sampler, false, 3));
    } else if (const std::size_t targets = morph_targets(data, node); path == "weights" && targets > 0) {
      pose.weights = samplers.value(sampler, true, targets);
      for (double& weight : pose.weights ? *pose.weights : none) {
        weight = std::isfinite(weight) ? std::clamp(weight, -kMaxWeight, kMaxWeight) : 0;
      }
    } else {
      target.fault(fmt::format("\"{}\" cannot be animated", utf8_text(path.substr(0, 40))), "its animation is skipped");
    }
  }
  LM_RETURN_IF_ERROR(data.status());
  return poses;
}

std::shared_ptr<const std::vector<Transform>> joints_of(const GltfData& data, const JsonNode& skin,
                                                        const std::unordered_map<std::string, Transform>& places) {
  const JsonNode joints = skin["joints"], inverse = skin["inverseBindMatrices"];
  std::vector<std::array<double, 16>> binds;
  if (inverse.present()) {
    if (const std::size_t count = data.count(inverse); data.status().ok() && count < joints.size()) {
      inverse.fail(fmt::format("{} matrices are expected, got {}", joints.size(), count));
    }
    std::vector<std::uint32_t> which(joints.size());
    for (std::size_t i = 0; i < which.size(); ++i) {
      which[i] = static_cast<std::uint32_t>(i);
    }
    if (data.status().ok()) {
      binds = data.vectors<16>(inverse, which);
    }
  }
  auto out = std::make_shared<std::vector<Transform>>();
  for (std::size_t i = 0; i < joints.size() && data.status().ok(); ++i) {
    const auto place = places.find(data.element("nodes", joints.at(i)).path());
    if (place == places.end()) {
      joints.at(i).fault("the joint is not in the scene", "meshes with this skin keep their modelled pose");
      return nullptr;
    }
    Transform bind = kIdentityTransform;
    for (std::size_t row = 0; row < 3 && !binds.empty(); ++row) {
      for (std::size_t column = 0; column < 4; ++column) {
        bind[row][column] = binds[i][4 * column + row];
      }
    }
    out->push_back(compose(place->second, bind));
  }
  if (out->empty() && data.status().ok()) {
    joints.fault("a skin without joints", "meshes with it keep their modelled pose");
  }
  return out->empty() ? nullptr : out;
}

}  // namespace lightmill
