// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/image.h>

namespace toftwin::sim {

/// Radiance from all directions in which the scene has nothing: a picture in latitude and longitude and
/// a sun. None of it is modulated. The picture's columns go round the axis `up`, its top row is up; its
/// middle column lies in the direction `ahead`.
class Environment {
 public:
  struct Sun {
    Vec3d towards{0.0, -1.0, 0.0};  ///< unit, from the scene to the sun
    double irradiance = 0.0;        ///< W/m² on a surface that faces it
  };

  Environment() = default;
  /// `radiance` in W/(m² sr), empty for none. `up` and `ahead` unit and perpendicular.
  Environment(Image<float> radiance, Vec3d up, Vec3d ahead, Sun sun);

  [[nodiscard]] bool isDark() const { return radiance_.empty() && sun_.irradiance == 0.0; }
  /// What a ray in this direction meets.
  [[nodiscard]] double radiance(Vec3d direction) const;
  /// The same, picture and sun apart.
  struct Seen {
    double picture = 0.0, sun = 0.0;
    double picture_density = 0.0, sun_density = 0.0;  ///< with which draw() gives this direction, 1/sr
  };
  [[nodiscard]] Seen seen(Vec3d direction) const;

  /// Directions towards light, by its strength.
  struct Drawn {
    Vec3d direction;
    double radiance = 0.0, density = 0.0;
  };
  [[nodiscard]] bool hasPicture() const { return !radiance_.empty(); }
  [[nodiscard]] bool hasSun() const { return sun_.irradiance > 0.0; }
  [[nodiscard]] Drawn drawPicture(double u, double v) const;
  [[nodiscard]] Drawn drawSun(double u, double v) const;

 private:
  struct Pixel {
    int x, y;
  };
  [[nodiscard]] Pixel pixelAt(Vec3d direction) const;
  [[nodiscard]] double densityOf(Pixel pixel) const;

  Image<float> radiance_;
  Vec3d up_{0.0, -1.0, 0.0}, ahead_{0.0, 0.0, 1.0}, side_;
  Sun sun_;
  // Sums of radiance × solid angle: of rows, and of pixels within each row.
  std::vector<double> row_sums_, pixel_sums_;
};

}  // namespace toftwin::sim
