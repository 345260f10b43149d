#pragma once
// Stability of textures, fields and knocks: a mass at the end of a device, pressed onto a plate or
// moving in a field, released from rest. For studies, not for the servo.

#include <string>
#include <vector>

namespace palpate::runner::evidence {

/// One case: the least physical damping with which it comes to rest.
struct EffectStability {
  std::string what;     ///< "sine 0.4 mm on 2 mm, 0.5 N", "viscous 20 N s/m", ...
  double measured = 0;  ///< N s/m, by bisection to 1 %; 0: stable without damping
  double theory = 0;    ///< N s/m, with which every hand is stable
  bool holds() const { return measured <= theory * 1.02; }
};

/// Sines of 0.1 and 0.4 mm on 1, 2 and 4 mm, pressed with 0.5 and 2 N; viscous and curl fields with
/// low passes of 0, 2 and 10 ms; knocks. 800 N/m, 1 kHz, forces within the same tick. The theory of
/// a texture and a knock is that of the material alone, K T / 2 (Colgate & Schenkel 1997); of
/// fields see servo::demand_of.
std::vector<EffectStability> effect_stability();

/// A table of them, and a sentence.
std::string effect_stability_text(const std::vector<EffectStability>& rows);

}  // namespace palpate::runner::evidence
