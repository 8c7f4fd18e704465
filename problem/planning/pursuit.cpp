#include <tandem/problem/planning/pursuit.hpp>

namespace tandem {

template Vector<3> command_for(const VehicleModel<3>&, const VehicleState<3>&, const Vector<3>&, const Vector<6>&);
template Vector<8> command_for(const VehicleModel<8>&, const VehicleState<8>&, const Vector<3>&, const Vector<6>&);
template Vector<3> pursue(const VehicleModel<3>&, const VehicleState<3>&, const Vector<3>&, const SE3&,
                          const Vector<6>&, const PursuitOptions&);
template Vector<8> pursue(const VehicleModel<8>&, const VehicleState<8>&, const Vector<3>&, const SE3&,
                          const Vector<6>&, const PursuitOptions&);
template Vector<3> keep_course(const VehicleModel<3>&, const VehicleState<3>&, const Vector<3>&, const SO3&, double,
                               const PursuitOptions&);
template Vector<8> keep_course(const VehicleModel<8>&, const VehicleState<8>&, const Vector<3>&, const SO3&, double,
                               const PursuitOptions&);

}  // namespace tandem
