// Parts of a scene that mesh files do not have: a camera and light.
#pragma once

#include "common/scene/compiled/world_frame.h"
#include "common/scene_io/load.h"

namespace lightmill {

/// The notice of a camera that nobody chose.
inline constexpr std::string_view kCameraWasAdded =
    "there is no camera: one was added that sees all from the front, above and right (--camera chooses another)";

/// A camera that sees a box from the front, the right and above. The box's bounding sphere fills the view.
Camera camera_for(const Bounds& box);

/// Gives the scene such a camera of all its objects. INVALID_ARGUMENT if it has only planes.
Status use_automatic_camera(LoadedScene& loaded);

/// Adds a uniform white sky of radiance 1.
void add_uniform_sky(LoadedScene& loaded);

/// Adds a soft sky: its radiance from the unit direction w is 0.6 (1 + w · d). The unit vector d is up, to the left
/// and to the front. A diffuse surface of normal n gets the irradiance π (0.6 + 0.4 n · d), so that no two sides of a
/// cube look alike, and white surfaces differ from what is behind them.
void add_soft_sky(LoadedScene& loaded);

/// Gives a scene without a camera the automatic one, with a notice. If its bounds are those of the Cornell box, it gets
/// the usual view into the box instead.
void add_missing_camera(LoadedScene& loaded);

/// Adds a soft sky, with a notice, unless something lights the scene (is_lit). The Cornell box only needs an emitter.
void add_missing_light(LoadedScene& loaded);

}  // namespace lightmill
