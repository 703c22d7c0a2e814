//! The box test and every primitive's kernel at every width. Elements are (ray, primitive) tests.
//!
//! Ids: `<kernel>/random/closest/<precision>x<width>`. Each width's hits are compared with width 1, bit for bit,
//! before its clock starts.

mod common;

use std::hint::black_box;
use std::marker::PhantomData;

use common::{Random, require_same};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use lanecast::lanes::{Lanes, Pair, Real, f32x4, f32x8, f32x16, f64x2, f64x4, f64x8};
use lanecast::math::Aabb;
use lanecast::ray::slab::Interval;
use lanecast::ray::{Candidate, HitPacket, Hits, Packet, Rays};
use lanecast::shape::{
    BLOCK, Block, Cone, Cuboid, Cylinder, Disc, HalfSpace, Placed, PlacedRecord, Solid, Sphere, SphereRecord, Triangle,
    TriangleBlock, WorldSphere,
};

/// Rays per pass.
const RAYS: usize = 1024;

/// Eight primitives of one kind and their test.
trait Kernel {
    type Data<S: Real>;
    fn name() -> String;
    fn data<S: Real>(r: &mut Random) -> Self::Data<S>;
    fn test<V: Lanes>(data: &Self::Data<V::Scalar>, packet: &Packet<V>, hit: &mut HitPacket<V>);
}

/// Entry into a box.
struct Boxes;

impl Kernel for Boxes {
    type Data<S: Real> = [Aabb<S>; BLOCK];

    fn name() -> String {
        "box".into()
    }

    fn data<S: Real>(r: &mut Random) -> Self::Data<S> {
        std::array::from_fn(|_| {
            let (a, b) = (r.cube() * 2.0, r.cube() * 2.0);
            Aabb::enclosing(a.min(b), a.max(b))
        })
    }

    #[inline(always)]
    fn test<V: Lanes>(data: &Self::Data<V::Scalar>, packet: &Packet<V>, hit: &mut HitPacket<V>) {
        for (i, bounds) in data.iter().enumerate() {
            let interval = Interval::of(packet, bounds.lo, bounds.hi);
            let (t, zero) = (interval.near.fast_max(packet.t_min), V::constant(0.0));
            let found = Candidate { hit: interval.meets(packet.t_min, hit.t), t, u: zero, v: zero };
            hit.commit(V::ALL, &found, i as u32, 0);
        }
    }
}

struct Triangles;

impl Kernel for Triangles {
    type Data<S: Real> = TriangleBlock<S>;

    fn name() -> String {
        "triangle".into()
    }

    fn data<S: Real>(r: &mut Random) -> Self::Data<S> {
        let mut block = Block::empty();
        for i in 0..BLOCK {
            let corners = [r.cube(), r.cube(), r.cube()].map(|p| p * 2.0);
            block.set(i, Triangle::record(corners).expect("random corners span a plane"), i as u32);
        }
        block
    }

    #[inline(always)]
    fn test<V: Lanes>(data: &Self::Data<V::Scalar>, packet: &Packet<V>, hit: &mut HitPacket<V>) {
        Triangle::intersect(packet, hit.t, data, (1 << BLOCK) - 1, V::ALL, |found, lanes, prim| {
            hit.commit(lanes, found, prim, 0)
        });
    }
}

struct WorldSpheres;

impl Kernel for WorldSpheres {
    type Data<S: Real> = [SphereRecord<S>; BLOCK];

    fn name() -> String {
        "world_sphere".into()
    }

    fn data<S: Real>(r: &mut Random) -> Self::Data<S> {
        std::array::from_fn(|_| {
            let c = r.cube() * 2.0;
            [c.x, c.y, c.z, 0.3 + 0.5 * r.unit()].map(S::from_f64)
        })
    }

    #[inline(always)]
    fn test<V: Lanes>(data: &Self::Data<V::Scalar>, packet: &Packet<V>, hit: &mut HitPacket<V>) {
        for (i, numbers) in data.iter().enumerate() {
            let span = WorldSphere::span(packet.org, packet.dir, numbers);
            hit.commit(V::ALL, &span.nearest(packet, &WorldSphere::bounds(numbers)), i as u32, 0);
        }
    }
}

/// A canonical solid under random affine maps.
struct Solids<K>(PhantomData<K>);

impl<K: Solid> Kernel for Solids<K> {
    type Data<S: Real> = [PlacedRecord<S>; BLOCK];

    fn name() -> String {
        let path = std::any::type_name::<K>();
        path.rsplit("::").next().unwrap_or(path).to_lowercase()
    }

    fn data<S: Real>(r: &mut Random) -> Self::Data<S> {
        std::array::from_fn(|_| {
            let turn = DQuat::from_axis_angle((r.cube() + DVec3::Z * 1.1).normalize(), 3.0 * r.unit());
            let scale = DVec3::new(0.4 + r.unit(), 0.4 + r.unit(), 0.4 + r.unit());
            let map =
                DAffine3 { matrix3: DMat3::from_quat(turn) * DMat3::from_diagonal(scale), translation: r.cube() * 2.0 };
            Placed::record::<S, K>(&map, 0.4).expect("the map can be inverted")
        })
    }

    #[inline(always)]
    fn test<V: Lanes>(data: &Self::Data<V::Scalar>, packet: &Packet<V>, hit: &mut HitPacket<V>) {
        for (i, numbers) in data.iter().enumerate() {
            let found = Placed::span::<V, K>(packet, numbers).nearest(packet, &Placed::bounds(numbers));
            hit.commit(V::ALL, &found, i as u32, 0);
        }
    }
}

/// Rays from a common eye, 16 neighbours at a time in one direction, as packets of a picture are.
fn rays<S: Real>(r: &mut Random) -> Rays<S> {
    let eye = DVec3::new(5.0, 3.0, 4.0);
    let mut rays = Rays::new(RAYS);
    let mut middle = DVec3::ZERO;
    for i in 0..RAYS {
        if i % 16 == 0 {
            middle = r.cube() * 2.0;
        }
        let dir = middle + r.cube() * 0.1 - eye;
        // Both precisions trace the same rays.
        let narrow = |v: DVec3| v.as_vec3().to_array().map(|x| S::from_f64(f64::from(x)));
        rays.set(i, narrow(eye), narrow(dir), S::ZERO, S::INFINITY);
    }
    rays
}

#[inline(always)]
fn pass<K: Kernel, V: Lanes>(data: &K::Data<V::Scalar>, packets: &[Packet<V>], hits: &mut Hits<V::Scalar>) {
    for (i, packet) in packets.iter().enumerate() {
        let mut hit = HitPacket::new(V::splat(V::Scalar::INFINITY));
        K::test(data, packet, &mut hit);
        hit.store(hits, i * V::N);
    }
}

fn width<K: Kernel, V: Lanes>(criterion: &mut Criterion, precision: &str) {
    let mut r = Random(7);
    let (data, rays) = (K::data::<V::Scalar>(&mut r), rays::<V::Scalar>(&mut r));
    let packets: Vec<_> = (0..RAYS).step_by(V::N).map(|at| Packet::<V>::load(&rays, at).0).collect();
    let singles: Vec<_> = (0..RAYS).map(|at| Packet::<V::Scalar>::load(&rays, at).0).collect();
    let (mut hits, mut want) = (Hits::new(RAYS), Hits::new(RAYS));
    pass::<K, V>(&data, &packets, &mut hits);
    pass::<K, V::Scalar>(&data, &singles, &mut want);
    let engine = format!("{precision}x{}", V::N);
    require_same(&format!("{} {engine}", K::name()), &hits, &want);

    let mut group = criterion.benchmark_group(format!("{}/random/closest", K::name()));
    group.throughput(Throughput::Elements((RAYS * BLOCK) as u64));
    group.bench_function(engine, |b| {
        b.iter(|| {
            pass::<K, V>(black_box(&data), black_box(&packets), &mut hits);
            black_box(&hits.t);
        });
    });
    group.finish();
}

fn kernel<K: Kernel>(criterion: &mut Criterion) {
    width::<K, f32>(criterion, "f32");
    width::<K, f32x4>(criterion, "f32");
    width::<K, f32x8>(criterion, "f32");
    width::<K, f32x16>(criterion, "f32");
    width::<K, f64>(criterion, "f64");
    width::<K, f64x2>(criterion, "f64");
    width::<K, f64x4>(criterion, "f64");
    width::<K, f64x8>(criterion, "f64");
    width::<K, Pair<f64x8>>(criterion, "f64");
}

fn all(criterion: &mut Criterion) {
    kernel::<Boxes>(criterion);
    kernel::<Triangles>(criterion);
    kernel::<WorldSpheres>(criterion);
    kernel::<Solids<Sphere>>(criterion);
    kernel::<Solids<HalfSpace>>(criterion);
    kernel::<Solids<Disc>>(criterion);
    kernel::<Solids<Cuboid>>(criterion);
    kernel::<Solids<Cylinder>>(criterion);
    kernel::<Solids<Cone>>(criterion);
}

criterion_group!(kernels, all);
criterion_main!(kernels);
