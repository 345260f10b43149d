// The Open Dynamics Engine's rigid bodies: https://ode.org, BSD licence.

#include <ode/ode.h>

#include <array>
#include <cmath>
#include <cstdarg>

#include "runner/evidence/accuracy/body_study.h"

namespace palpate::runner::evidence::peers {
namespace {

class OdeBodies final : public BodyEngine {
 public:
  explicit OdeBodies(const BodyCase& of)
      : world_(dWorldCreate()), space_(dHashSpaceCreate(nullptr)), joints_(dJointGroupCreate(0)) {
    dWorldSetGravity(world_, of.gravity.x, of.gravity.y, of.gravity.z);
    boxes_ = of.boxes;
    for (BodyBox& box : boxes_) add(box);
  }
  ~OdeBodies() override {
    dJointGroupDestroy(joints_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }
  OdeBodies(const OdeBodies&) = delete;
  OdeBodies& operator=(const OdeBodies&) = delete;

  void step(double dt) override {
    dSpaceCollide(space_, this, &OdeBodies::collide);
    dWorldStep(world_, dt);
    dJointGroupEmpty(joints_);
  }
  std::vector<BoxMotion> motion() const override {
    std::vector<BoxMotion> out;
    for (const dBodyID body : bodies_) {
      if (body == nullptr) continue;
      const dReal *p = dBodyGetPosition(body), *q = dBodyGetQuaternion(body),
                  *v = dBodyGetLinearVel(body), *w = dBodyGetAngularVel(body);
      out.push_back({{p[0], p[1], p[2]},
                     Quat(q[0], q[1], q[2], q[3]),
                     {v[0], v[1], v[2]},
                     {w[0], w[1], w[2]}});
    }
    return out;
  }

 private:
  static void collide(void* data, dGeomID a, dGeomID b) {
    auto& self = *static_cast<OdeBodies*>(data);
    const BodyBox& of_a = *static_cast<const BodyBox*>(dGeomGetData(a));
    const BodyBox& of_b = *static_cast<const BodyBox*>(dGeomGetData(b));
    std::array<dContact, 8> contacts{};
    const int count =
        dCollide(a, b, static_cast<int>(contacts.size()), &contacts[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      dContact& contact = contacts[static_cast<std::size_t>(i)];
      contact.surface.mode = dContactBounce | dContactApprox1;
      contact.surface.mu = std::sqrt(of_a.friction * of_b.friction);
      contact.surface.bounce = std::sqrt(of_a.restitution * of_b.restitution);
      contact.surface.bounce_vel = 1e-3;
      dJointAttach(dJointCreateContact(self.world_, self.joints_, &contact), dGeomGetBody(a),
                   dGeomGetBody(b));
    }
  }

  void add(BodyBox& box) {
    const dGeomID geometry = dCreateBox(space_, box.size.x, box.size.y, box.size.z);
    dGeomSetData(geometry, &box);
    const Quat& q = box.pose.orientation;
    const dQuaternion turn = {q.w, q.x, q.y, q.z};
    const Vec3& p = box.pose.position;
    dBodyID body = nullptr;
    if (box.mass > 0) {
      body = dBodyCreate(world_);
      dMass mass;
      dMassSetBoxTotal(&mass, box.mass, box.size.x, box.size.y, box.size.z);
      dBodySetMass(body, &mass);
      dGeomSetBody(geometry, body);
      dBodySetLinearVel(body, box.velocity.x, box.velocity.y, box.velocity.z);
      dBodySetAngularVel(body, box.spin.x, box.spin.y, box.spin.z);
    }
    dGeomSetPosition(geometry, p.x, p.y, p.z);
    dGeomSetQuaternion(geometry, turn);
    bodies_.push_back(body);
  }

  /// Sets up the library once for the program. Silences its messages on unsolved contacts: they
  /// show in its error.
  struct Library {
    Library() {
      dSetMessageHandler([](int, const char*, va_list) {});
      dInitODE2(0);
    }
    ~Library() { dCloseODE(); }
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;
  } library_;
  dWorldID world_;
  dSpaceID space_;
  dJointGroupID joints_;
  std::vector<BodyBox> boxes_;
  std::vector<dBodyID> bodies_;
};

}  // namespace

std::unique_ptr<BodyEngine> make_ode_bodies(const BodyCase& of) {
  return std::make_unique<OdeBodies>(of);
}

}  // namespace palpate::runner::evidence::peers
