// Point lights with measured intensity: IES profiles.
#pragma once

#include "common/lights/ies_profile.h"
#include "common/lights/light_sample.h"

namespace lightmill {

struct IesEmitter {
  Vec3 position;
  Vec3 direction;  ///< unit, the direction of vertical angle 0
  /// Unit, perpendicular to the direction, towards horizontal angle 0. Angle 90 is −direction × reference.
  Vec3 reference;
  Vec3 per_candela;         ///< W/sr per candela of the profile
  std::size_t profile = 0;  ///< as add_profile returned it
};

/// Intensities are bilinear between the profile's angles, as in IesProfile::at.
class IesLights {
 public:
  /// Lights share profiles.
  std::size_t add_profile(const IesProfile& profile);
  /// Number of candela values of all profiles. It must be below 2^31 for gathers.
  std::size_t values() const { return candela_.size(); }
  void add(const IesEmitter& light);
  std::size_t size() const { return position_.size(); }
  std::uint64_t bytes() const {
    return 4 * (vertical_.size() + horizontal_.size() + candela_.size()) + 68 * position_.size();
  }
  LightBounds bounds(std::size_t i) const;
  LightSample8 sample(const V8& p, U8 index, M8 lanes) const;

  V8 position(U8 index, M8 lanes) const { return position_.at(index, lanes); }
  /// In unit directions, W/sr.
  V8 intensity(const V8& direction, U8 index, M8 lanes) const {
    return per_candela_.at(index, lanes) * candela(direction, index, lanes);
  }

 private:
  /// Positions of a profile's angles and values.
  struct Profile {
    std::uint32_t vertical, verticals, horizontal, horizontals, value;
    double lumen, peak;  ///< flux, and the largest candela
  };
  F8 candela(U8 index, F8 vertical, F8 horizontal, M8 lanes) const;
  /// In unit directions.
  F8 candela(const V8& direction, U8 index, M8 lanes) const;

  std::vector<Profile> profiles_;
  std::vector<float> vertical_, horizontal_;       ///< degrees, of all profiles
  std::vector<float> candela_;                     ///< [horizontal][vertical] of each profile
  int vertical_steps_ = 0, horizontal_steps_ = 0;  ///< bisection steps that find a cell of any profile

  VectorRows position_, direction_, reference_, per_candela_;
  std::vector<std::uint32_t> profile_;
  // Of each light's profile, for gathers.
  std::vector<std::uint32_t> first_vertical_, verticals_, first_horizontal_, horizontals_, first_value_;
};

}  // namespace lightmill
