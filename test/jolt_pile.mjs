// Drops the dolls that standard input tells of by Jolt, in WebAssembly and one thread; see
// jolt_pile.py. Prints what each tick took, s, and poses at some of them.
import { readFileSync } from 'node:fs';

const { default: load } = await import(process.argv[2]);
const Jolt = await load();
const scene = JSON.parse(readFileSync(0, 'utf8'));
const [STILL, MOVING] = [0, 1];

const vec = (v) => new Jolt.Vec3(v[0], v[1], v[2]);
const point = (v) => new Jolt.RVec3(v[0], v[1], v[2]);
const turn = (q) => new Jolt.Quat(q[0], q[1], q[2], q[3]);

const settings = new Jolt.JoltSettings();
settings.mMaxBodies = 4096;
settings.mMaxBodyPairs = 16384;
settings.mMaxContactConstraints = 10240;
const pairs = new Jolt.ObjectLayerPairFilterTable(2);
pairs.EnableCollision(STILL, MOVING);
pairs.EnableCollision(MOVING, MOVING);
const broad = new Jolt.BroadPhaseLayerInterfaceTable(2, 2);
for (const layer of [STILL, MOVING])
  broad.MapObjectToBroadPhaseLayer(layer, new Jolt.BroadPhaseLayer(layer));
settings.mObjectLayerPairFilter = pairs;
settings.mBroadPhaseLayerInterface = broad;
settings.mObjectVsBroadPhaseLayerFilter =
  new Jolt.ObjectVsBroadPhaseLayerFilterTable(broad, 2, pairs, 2);
const jolt = new Jolt.JoltInterface(settings);
const system = jolt.GetPhysicsSystem(), world = system.GetBodyInterface();
system.SetGravity(vec(scene.gravity));

function add(shape, made, place) {
  const body = new Jolt.BodyCreationSettings(shape, point(place.position), turn(place.orientation),
    made === STILL ? Jolt.EMotionType_Static : Jolt.EMotionType_Dynamic, made);
  body.mFriction = scene.friction;
  body.mRestitution = scene.restitution;
  if (made === MOVING) {
    body.mOverrideMassProperties = Jolt.EOverrideMassProperties_CalculateInertia;
    body.mMassPropertiesOverride.mMass = place.mass;
    body.mCollisionGroup = new Jolt.CollisionGroup(filter, place.doll, place.part);
  }
  const one = world.CreateBody(body);
  world.AddBody(one.GetID(), made === STILL ? Jolt.EActivation_DontActivate
    : Jolt.EActivation_Activate);
  return one;
}

const filter = new Jolt.GroupFilterTable(scene.parts);
for (const [one, other] of scene.apart) filter.DisableCollision(one, other);
add(new Jolt.BoxShape(vec([100, 100, 1]), 0.05), STILL,
  { position: [0, 0, -1], orientation: [0, 0, 0, 1] });
const bodies = scene.bones.map((bone) => add(bone.half.length === 1
  ? new Jolt.SphereShape(bone.half[0])
  : new Jolt.BoxShape(vec(bone.half), Math.min(0.05, 0.25 * Math.min(...bone.half))), MOVING, bone));

function hinge(joint) {
  const made = new Jolt.HingeConstraintSettings();
  for (const side of [1, 2]) {
    made['mPoint' + side] = point(joint.anchor);
    made['mHingeAxis' + side] = vec(joint.axes[0]);
    made['mNormalAxis' + side] = vec(joint.across);
  }
  [made.mLimitsMin, made.mLimitsMax] = joint.limits[0];
  return made;
}

function universal(joint) {
  const made = new Jolt.SixDOFConstraintSettings();
  for (const side of [1, 2]) {
    made['mPosition' + side] = point(joint.anchor);
    made['mAxisX' + side] = vec(joint.across);
    made['mAxisY' + side] = vec(joint.axes[0]);
  }
  made.mSwingType = Jolt.ESwingType_Pyramid;
  for (const axis of ['TranslationX', 'TranslationY', 'TranslationZ', 'RotationX'])
    made.MakeFixedAxis(Jolt['SixDOFConstraintSettings_EAxis_' + axis]);
  ['RotationY', 'RotationZ'].forEach((axis, k) => made.SetLimitedAxis(
    Jolt['SixDOFConstraintSettings_EAxis_' + axis], ...joint.limits[k]));
  return made;
}

for (const joint of scene.joints) {
  const made = joint.axes.length === 1 ? hinge(joint) : universal(joint);
  made.mSpace = Jolt.EConstraintSpace_WorldSpace;
  system.AddConstraint(made.Create(bodies[joint.parent], bodies[joint.child]));
}

for (let tick = 0; tick < scene.ticks; tick++) {
  const begin = performance.now();
  jolt.Step(scene.step, scene.collision_steps);
  const told = { seconds: (performance.now() - begin) / 1e3,
    awake: bodies.filter((body) => body.IsActive()).length };
  if (tick % scene.looks === 0) told.poses = bodies.map((body) => {
    const p = body.GetPosition(), q = body.GetRotation();
    return [p.GetX(), p.GetY(), p.GetZ(), q.GetX(), q.GetY(), q.GetZ(), q.GetW()];
  });
  console.log(JSON.stringify(told));
}
