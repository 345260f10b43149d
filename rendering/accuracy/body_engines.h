#pragma once
// The engines of body_study.h. Those of other libraries exist if CMake finds the libraries.

#include <memory>
#include <string>
#include <vector>

#include "rendering/accuracy/body_study.h"

namespace palpate::rendering {

struct BodyEngineKind {
  std::string name;
  std::unique_ptr<BodyEngine> (*make)(const BodyCase& of);
};
std::vector<BodyEngineKind> body_engines();

namespace peers {
std::unique_ptr<BodyEngine> make_bullet_bodies(const BodyCase& of);
std::unique_ptr<BodyEngine> make_ode_bodies(const BodyCase& of);
}  // namespace peers

}  // namespace palpate::rendering
