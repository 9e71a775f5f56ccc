#include "common/scene_io/picture_notices.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/math/vec.h"
#include "common/scene/compiled/convert.h"
#include "common/scene/compiled/transform.h"
#include "common/scene/validate/validate.h"
#include "common/scene_io/scene_bounds.h"
#include "common/scene_io/scene_light.h"

namespace lightmill {
namespace {

constexpr double kTiny = 1.0 / 20;  ///< share of the film's width and height below which objects are too small

/// The part of the film, whose edges are at ±1, in which a camera may see boxes.
class View {
 public:
  View(const Camera& camera, const FilmSettings& film) : eye_(to_vec(camera.eye)) {
    forward_ = glm::normalize(near_one(to_vec(camera.look_at) - eye_));
    right_ = glm::normalize(near_one(glm::cross(forward_, glm::normalize(near_one(to_vec(camera.up))))));
    up_ = glm::cross(right_, forward_);
    // Rays start up to the pixel filter's radius beyond the film's edges.
    const double pixel = std::tan(camera.vertical_fov_degrees * std::numbers::pi / 360) * 2 / film.height;
    half_height_ = pixel * (0.5 * film.height + film.filter.radius_pixels);
    half_width_ = pixel * (0.5 * film.width + film.filter.radius_pixels);
  }

  void add(const Bounds& box, const Affine& map) {
    Vec3d low{std::numeric_limits<double>::infinity()}, high = -low;
    int in_front = 0;
    for (int i = 0; i < 8; ++i) {
      const Vec3d p = map(corner_of(box, i)) - eye_;
      const double depth = glm::dot(p, forward_);
      in_front += depth > 0 ? 1 : 0;
      const Vec3d place(glm::dot(p, right_) / (depth * half_width_), glm::dot(p, up_) / (depth * half_height_), 0);
      low = glm::min(low, place);
      high = glm::max(high, place);
    }
    if (in_front == 0) {
      return;
    }
    if (in_front < 8) {  // it reaches behind the camera, so it may be anywhere
      low = Vec3d(-1);
      high = Vec3d(1);
    }
    low = glm::max(low, Vec3d(-1));
    high = glm::min(high, Vec3d(1));
    if (low.x <= high.x && low.y <= high.y) {
      seen_ = true;
      low_ = glm::min(low_, low);
      high_ = glm::max(high_, high);
    }
  }

  bool nothing() const { return !seen_; }
  /// Shares of the film's width and height.
  double width() const { return (high_.x - low_.x) / 2; }
  double height() const { return (high_.y - low_.y) / 2; }
  bool is_tiny() const { return seen_ && width() < kTiny && height() < kTiny; }

 private:
  Vec3d eye_, forward_, right_, up_;
  double half_width_ = 1, half_height_ = 1;
  bool seen_ = false;
  Vec3d low_{1}, high_{-1};
};

/// The notice on the view. Empty if there is none.
std::string view_notice(const LoadedScene& loaded, Boxes& boxes) {
  const Scene& scene = loaded.scene;
  const auto is_plane = [](const Object& object) { return std::holds_alternative<PlaneShape>(object.shape); };
  const auto is_sky = [](const Light& light) { return std::holds_alternative<EnvironmentLight>(light.kind); };
  if (scene.camera.lens_radius > 0 || std::ranges::any_of(scene.objects, is_plane) ||
      std::ranges::any_of(scene.lights, is_sky)) {
    return "";
  }
  View view(scene.camera, scene.film);
  for (const Object& object : scene.objects) {
    view.add(boxes.of(object), Affine(object.transform));
    if (!view.nothing() && !view.is_tiny()) {
      return "";
    }
  }
  const Point3d &eye = scene.camera.eye, &to = scene.camera.look_at;
  const std::string camera = fmt::format("the camera at ({:g}, {:g}, {:g}), looking at ({:g}, {:g}, {:g}),", eye[0],
                                         eye[1], eye[2], to[0], to[1], to[2]);
  if (view.nothing()) {
    return fmt::format("{} sees nothing of the scene: choose another with --camera", camera);
  }
  return fmt::format("{} sees all of the scene within {:.0f}x{:.0f} pixels: choose another with --camera", camera,
                     std::ceil(view.width() * scene.film.width), std::ceil(view.height() * scene.film.height));
}

/// The size of a material's largest shape. Flat shapes count together.
double thickness(const LoadedScene& loaded, std::uint32_t material, Boxes& boxes) {
  double most = 0;
  Bounds faces;
  for (const Object& object : loaded.scene.objects) {
    if (object.material != material) {
      continue;
    }
    if (std::holds_alternative<PlaneShape>(object.shape)) {
      return std::numeric_limits<double>::infinity();
    }
    const Bounds& own = boxes.of(object);
    const Affine map(object.transform);
    Bounds box;
    for (int i = 0; i < 8; ++i) {
      box.add(map(corner_of(own, i)));
    }
    const Vec3d size = box.size();
    const double across = std::min({size.x, size.y, size.z});
    most = std::max(most, across);
    if (across == 0) {
      faces.add(box.low);
      faces.add(box.high);
    }
  }
  const Vec3d size = faces.size();
  return std::max({most, std::min({size.x, size.y, size.z}), 0.0});
}

/// Light leaves a medium of optical thickness τ after about τ² scatterings, unless it is absorbed before. Of the light
/// that such a medium shows, a share of about 1/√n has paths longer than the limit n. That is a few per cent.
void say_dense_media(const LoadedScene& loaded, std::uint32_t max_bounces, Boxes& boxes,
                     std::vector<std::string>& notices) {
  constexpr double kDense = 100;     // optical thickness
  constexpr double kMaxLost = 1e-2;  // share that would scatter on at the limit, after absorption
  constexpr std::size_t kMaxNamed = 10;
  std::size_t named = 0;
  for (std::size_t i = 0; i < loaded.scene.materials.size() && named < kMaxNamed; ++i) {
    const Medium& medium = loaded.scene.materials[i].interior;
    const RgbColor &s = medium.scattering, &a = medium.absorption;
    double densest = 0;
    for (const auto& [scattering, absorption] : {std::pair<double, double>{s.r, a.r}, {s.g, a.g}, {s.b, a.b}}) {
      const double albedo = scattering > 0 ? scattering / (scattering + absorption) : 0;
      if (albedo > 0 && max_bounces * std::log(albedo) > std::log(kMaxLost)) {
        densest = std::max(densest, scattering);
      }
    }
    if (densest == 0) {
      continue;
    }
    const double depth = densest * thickness(loaded, static_cast<std::uint32_t>(i), boxes);
    if (depth > kDense && depth * depth > max_bounces) {
      ++named;
      notices.push_back(fmt::format(
          "the medium \"{}\" scatters so densely (optical thickness {}) that some of its light, perhaps a few "
          "per cent, is lost, because paths end after {} bounces (--max-bounces)",
          loaded.scene.materials[i].name, std::isinf(depth) ? "infinite" : fmt::format("{:.3g}", depth), max_bounces));
    }
  }
}

/// Single precision places a sphere's surface to about 2^-22 of its radius. Near the camera that shows: gaps under
/// objects on the sphere, a ragged edge, the wrong shade.
void say_huge_spheres(const LoadedScene& loaded, std::vector<std::string>& notices) {
  constexpr double kMax =
      1e4;  // radius over distance: from the camera to the surface or to look_at, whichever is larger
  const Vec3d eye = to_vec(loaded.scene.camera.eye);
  const double looks = glm::distance(eye, to_vec(loaded.scene.camera.look_at));
  for (const Object& object : loaded.scene.objects) {
    const auto* const sphere = std::get_if<SphereShape>(&object.shape);
    if (sphere == nullptr) {
      continue;
    }
    const Affine map(object.transform);
    const double radius = sphere->radius * map.similarity_scale();
    const double distance = std::max(looks, std::abs(glm::distance(map(to_vec(sphere->center)), eye) - radius));
    if (radius > kMax * distance) {
      notices.push_back(
          fmt::format("the sphere \"{}\" is so large (radius {:g}) that near the camera its surface is only exact to "
                      "about {:.1g}: use a plane instead",
                      object.name, radius, std::ldexp(radius, -22)));
      return;
    }
  }
}

}  // namespace

std::vector<std::string> picture_notices(const LoadedScene& loaded, bool needs_light, std::uint32_t max_bounces) {
  std::vector<std::string> notices;
  if (needs_light && !emits_light(loaded.scene)) {
    notices.emplace_back("nothing emits light: the picture will be black");
  }
  Boxes boxes(loaded);
  if (std::string notice = view_notice(loaded, boxes); !notice.empty()) {
    notices.push_back(std::move(notice));
  }
  say_huge_spheres(loaded, notices);
  if (max_bounces > 0) {
    say_dense_media(loaded, max_bounces, boxes, notices);
  }
  return notices;
}

Status check_image_header(const ImageAsset& image, const ImageSize& size, std::vector<std::string>& notices) {
  const std::string where = fmt::format("{}: {}", image.place, image.name);
  const auto say_ignored = [&](bool is_ignored, std::string_view property, std::string_view instead) {
    if (is_ignored) {
      notices.push_back(fmt::format("{}: its {} is ignored: {}", where, property, instead));
    }
  };
  say_ignored(size.ignored.orientation, "Exif orientation", "the pixels count as they are stored");
  say_ignored(size.ignored.gamma, "gamma", "colours count as sRGB unless the scene says otherwise");
  say_ignored(size.ignored.profile, "ICC profile", "colours count as Rec. 709");
  if (!image.environment) {
    return ok_status();
  }
  LM_RETURN_IF_ERROR(with_context(check_environment_size(size.width, size.height, image.equal_area), where));
  if (!image.equal_area && std::abs(size.width - 2 * size.height) > 1) {  // an odd width cannot be exact
    notices.push_back(
        fmt::format("{}: its {}x{} pixels are stretched over all longitudes and latitudes. Such an image is twice as "
                    "wide as high",
                    where, size.width, size.height));
  }
  return ok_status();
}

}  // namespace lightmill
