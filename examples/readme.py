import impact
from impact import measures

rod = impact.fixed_rod(young=200e9, density=7850, area=4.17e-7, length=3e-3, damping_ratio=0.10)
reed = impact.cantilever_reed(
    young=200e9, density=7850, length=25.4e-3, width=10e-3, thickness=0.305e-3,
    damping_ratio=0.03, tip_deflection=1e-3,
)  # fmt: skip
spring = impact.spring(stiffness=1 / rod.static_compliance()[0, 0])
results = {
    name: impact.solve(impact.ContactProblem(reed, seat, gap=0.0, law=impact.Signorini()), dt=2e-8, duration=3e-3)
    for name, seat in (("rod", rod), ("spring", spring))
}
for name, result in results.items():
    start, end = measures.contact_groups(result)[0]
    print(f"{name}: strikes at {1e6 * start:.1f} us with {measures.impact_velocity(result):.3f} m/s,")
    print(f"  peak (1 us) {measures.filtered_peak_force(result, 1e-6):.2f} N, {measures.impulse(result):.4e} N s")
impact.plot_force(results["rod"], results["spring"], "force.png", names=("rod", "spring of equal static stiffness"))
assert abs(start - 653.32e-6) < 0.1e-6  # flight of the free reed, known from its modal sum
